//! Pictures with named channels.

use llsr_scene::{LightId, Scene, Viewport};

/// Quantities that can be stored for each pixel beside the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layer {
    /// Irradiance from all lights on the visible side of the surface.
    Irradiance,
    /// Irradiance from one light.
    IrradianceOf(LightId),
    /// Changes of visibility along all lights.
    Discontinuities,
    /// Visibility tests for all lights.
    Tests,
    /// The weakest certificate of all lights: 0 exact, 1 ends exact and gaps bounded, 2 sampled.
    Certificate,
    /// Base colour of the surface.
    Albedo,
    /// Shading normal, turned to the viewer.
    Normal,
    /// Distance along the ray (m); infinite where nothing is hit.
    Depth,
}

impl Layer {
    /// Reads a layer's name as the command line has it; `irradiance:*` gives one layer for each light.
    ///
    /// Names of lights are those of the scene. `None` if there is no such layer or light.
    pub fn parse(name: &str, scene: &Scene) -> Option<Vec<Self>> {
        let one = match name {
            "irradiance" => Self::Irradiance,
            "discontinuities" => Self::Discontinuities,
            "tests" => Self::Tests,
            "certificate" => Self::Certificate,
            "albedo" => Self::Albedo,
            "normal" => Self::Normal,
            "depth" => Self::Depth,
            "irradiance:*" => {
                return Some(
                    (0..scene.lights.len())
                        .map(|i| Self::IrradianceOf(LightId::from(i)))
                        .collect(),
                );
            }
            _ => {
                let light = name.strip_prefix("irradiance:")?;
                let index = scene.lights.iter().position(|l| l.name() == light)?;
                Self::IrradianceOf(LightId::from(index))
            }
        };
        Some(vec![one])
    }

    /// Names of its channels in a file.
    pub fn channel_names(self, scene: &Scene) -> Vec<String> {
        let (layer, channels): (String, &[&str]) = match self {
            Self::Irradiance => ("irradiance".to_owned(), &["Y"]),
            Self::IrradianceOf(light) => (
                format!("irradiance:{}", scene.lights[light.index()].name()),
                &["Y"],
            ),
            Self::Discontinuities => ("discontinuities".to_owned(), &["Y"]),
            Self::Tests => ("tests".to_owned(), &["Y"]),
            Self::Certificate => ("certificate".to_owned(), &["Y"]),
            Self::Albedo => ("albedo".to_owned(), &["R", "G", "B"]),
            Self::Normal => ("normal".to_owned(), &["X", "Y", "Z"]),
            Self::Depth => ("depth".to_owned(), &["Z"]),
        };
        channels
            .iter()
            .map(|channel| format!("{layer}.{channel}"))
            .collect()
    }

    /// Number of its channels.
    pub fn channel_count(self) -> usize {
        if matches!(self, Self::Albedo | Self::Normal) {
            3
        } else {
            1
        }
    }
}

/// A picture: reflected radiance in `R`, `G`, `B`, then the layers asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    /// Size in pixels.
    pub viewport: Viewport,
    /// Names and values (one a pixel, row by row from the top) of the channels: `R`, `G`, `B` for the picture, then
    /// `LAYER.CHANNEL`.
    pub channels: Vec<(String, Vec<f32>)>,
}

impl Film {
    /// A black picture with the given layers.
    pub fn new(viewport: Viewport, layers: &[Layer], scene: &Scene) -> Self {
        let picture = ["R", "G", "B"].map(str::to_owned).into_iter();
        let names = picture.chain(layers.iter().flat_map(|layer| layer.channel_names(scene)));
        let channels = names.map(|name| (name, vec![0.0; viewport.pixels()])).collect();
        Self { viewport, channels }
    }

    /// The channel of that name.
    pub fn channel(&self, name: &str) -> Option<&[f32]> {
        self.channels
            .iter()
            .find(|channel| channel.0 == name)
            .map(|channel| channel.1.as_slice())
    }

    /// Red, green and blue of each pixel, row by row.
    pub fn pixels(&self) -> impl Iterator<Item = [f32; 3]> + '_ {
        let [r, g, b] = [0, 1, 2].map(|i| &self.channels[i].1);
        (0..self.viewport.pixels()).map(move |i| [r[i], g[i], b[i]])
    }
}
