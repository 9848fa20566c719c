//! Layers as pictures to look at.

use glam::Vec3;
use llsr_scene::srgb_to_linear;
use llsr_shading::Film;

use crate::still::StillLayer;

/// The colours (linear sRGB, each channel in [0, 1]) that show a layer of a still picture, row by row; `None` for a layer that is no picture
/// of edges and points, or that `film` does not have.
///
/// Edges as in figures 7 and 10 of BWG03: pixels with one edge purple, complex ones green, the others white. Reach: the 24 bits of a
/// pixel's mask as the bytes that its red, green and blue have on the screen, so that what reaches everything is white and neighbours with the same mask have the
/// same colour. Samples: white where a pixel was shaded in the first round, yellow to red in later ones, green where points
/// were shaded in a pixel with more than one surface, dark grey where light was interpolated.
pub fn layer_colours(film: &Film, layer: StillLayer) -> Option<Vec<Vec3>> {
    let colour: fn(f32) -> Vec3 = match layer {
        StillLayer::Edges => |value| match value {
            1.0 => Vec3::new(0.0, 0.6, 0.0),
            0.5 => Vec3::new(0.25, 0.0, 0.6),
            _ => Vec3::ONE,
        },
        StillLayer::Reach => |value| {
            let [_, red, green, blue] = (value as u32).to_be_bytes();
            Vec3::from([red, green, blue].map(|byte| srgb_to_linear(f32::from(byte) / 255.0)))
        },
        StillLayer::Samples => |value| match value {
            0.0 => Vec3::splat(0.03),
            1.0 => Vec3::ONE,
            // Each round half of what the one before had of green.
            round if round > 0.0 => Vec3::new(1.0, (2.0 - round).exp2(), 0.0),
            _ => Vec3::new(0.0, 0.4, 0.0),
        },
        StillLayer::Irradiance | StillLayer::Albedo | StillLayer::Normal | StillLayer::Depth => return None,
    };
    let channel = film.channel(layer.channels().first()?)?;
    Some(channel.iter().copied().map(colour).collect())
}

#[cfg(test)]
mod tests {
    use llsr_scene::Viewport;

    use super::*;

    #[test]
    fn edges_samples_and_each_bit_of_a_mask_have_colours_of_their_own() {
        let film = Film {
            viewport: Viewport { width: 4, height: 1 },
            channels: vec![
                ("edges.Y".to_owned(), vec![0.0, 0.5, 1.0, 0.0]),
                ("samples.Y".to_owned(), vec![0.0, 1.0, 2.0, -3.0]),
                (
                    "reach.Y".to_owned(),
                    vec![16_777_215.0, 65_536.0 * 51.0, 256.0, 1.0],
                ),
                ("depth.Z".to_owned(), vec![1.0; 4]),
            ],
        };
        let shown = |layer| layer_colours(&film, layer).expect("such a layer");
        let edges = shown(StillLayer::Edges);
        assert_eq!(edges[0], Vec3::ONE, "no edge is white");
        assert!(
            edges[1].x > 0.0 && edges[1].y == 0.0 && edges[1].z > 0.0,
            "one edge is purple"
        );
        assert!(
            edges[2].x == 0.0 && edges[2].y > 0.0 && edges[2].z == 0.0,
            "complex is green"
        );
        let reach = shown(StillLayer::Reach);
        let byte = |v: f32| (255.0 * llsr_scene::linear_to_srgb(v)).round() as u8;
        let bytes: Vec<[u8; 3]> = reach.iter().map(|c| c.to_array().map(byte)).collect();
        assert_eq!(bytes, [[255; 3], [51, 0, 0], [0, 1, 0], [0, 0, 1]]);
        let samples = shown(StillLayer::Samples);
        for i in 0..4 {
            for j in 0..i {
                assert_ne!(samples[i], samples[j], "kinds {i} and {j} of pixels");
            }
        }
        assert_eq!(
            layer_colours(&film, StillLayer::Depth),
            None,
            "lengths are no picture"
        );
        let none = Film {
            channels: Vec::new(),
            ..film
        };
        assert_eq!(
            layer_colours(&none, StillLayer::Edges),
            None,
            "a layer that was not asked for"
        );
    }
}
