//! The same points without the edges, for comparison.

use llsr_epi::{EdgePointImage, Picture, Settings};

use crate::frame::patch::{PatchScratch, patch};
use crate::frame::renderer::planes;
use crate::frame::texture::TextureScratch;
use crate::frame::{FrameError, FrameRenderer};

/// Interpolates the points of a [`FrameRenderer`] without regard to edges, as the Render Cache does (BWG03, figure 11).
#[derive(Debug)]
pub struct BlindInterpolation {
    image: EdgePointImage,
    picture: Picture,
    scratch: PatchScratch,
    textures: TextureScratch,
}

impl BlindInterpolation {
    /// For pictures of the size of `renderer`'s, with its filter.
    ///
    /// # Errors
    /// None that the renderer did not have.
    pub fn new(renderer: &FrameRenderer) -> Result<Self, FrameError> {
        let (width, height) = (renderer.viewport().width, renderer.viewport().height);
        let settings = Settings {
            half_lines: false,
            ..*renderer.image().settings()
        };
        Ok(Self {
            image: EdgePointImage::new(width, height, settings)?,
            picture: Picture::new(width, height),
            scratch: PatchScratch::default(),
            textures: TextureScratch::default(),
        })
    }

    /// The picture from the points of the renderer's last frame.
    ///
    /// # Panics
    /// If the renderer has another size.
    pub fn draw(&mut self, renderer: &FrameRenderer) -> &Picture {
        let points = renderer.points();
        self.image
            .load_samples(planes(points, points.depth_plane(), points.region_plane()));
        self.image.classify();
        self.image.reach();
        self.image.interpolate(&mut self.picture);
        self.image.fill(&mut self.picture, 4);
        patch(&mut self.image, &mut self.picture, 1, &mut self.scratch);
        renderer.put_textures(&mut self.image, &mut self.picture, &mut self.textures);
        &self.picture
    }
}
