//! OpenEXR: one part, 32-bit floats, the same bytes for the same data.

use std::collections::HashSet;
use std::io::Cursor;
use std::path::Path;

use exr::block::lines::LineRefMut;
use exr::image::write::samples::{SamplesWriter, WritableSamples};
use exr::image::{AnyChannel, AnyChannels, FlatSamples};
use exr::math::RoundingMode;
use exr::meta::attribute::{LevelMode, SampleType};
use exr::meta::header::{Header, LayerAttributes};
use exr::meta::{BlockDescription, MetaData};
use exr::prelude::{Encoding, ReadChannels as _, ReadLayers as _, Text, WritableImage as _};

use super::{Image, decoded_limit};
use crate::error::Error;
use crate::files;

/// Writes all channels of `image`, uncompressed names as they are, values bit by bit, compressed without loss.
///
/// The header holds nothing but the size and the channels: no date, no machine, no program. A channel name that
/// the format cannot hold has its characters outside ASCII replaced by `_`, is cut to 255 bytes, and gets a number if it
/// then equals another one.
///
/// The file takes its name only when it is complete.
///
/// # Errors
/// If the picture is empty, its channels have different lengths, or the file cannot be written.
pub fn write_exr(path: &Path, image: &Image) -> Result<(), Error> {
    if let Some(fault) = image.fault() {
        return Err(Error::unwritable(path, fault));
    }
    let names = file_names(&image.channels);
    let list = names.iter().zip(&image.channels).map(|(name, (_, values))| {
        let samples = Borrowed {
            width: image.width,
            values,
        };
        AnyChannel::new(Text::new_or_none(name).unwrap_or_default(), samples)
    });
    let channels = AnyChannels::sort(list.collect());
    let size = (image.width, image.height);
    let layer = exr::image::Layer::new(
        size,
        LayerAttributes::default(),
        Encoding::SMALL_LOSSLESS,
        channels,
    );
    let file = exr::image::Image::from_layer(layer);
    files::write_atomically(path, |writer| {
        file.write()
            .non_parallel()
            .to_buffered(writer)
            .map_err(|error| match error {
                exr::error::Error::Io(error) => error,
                other => std::io::Error::other(other.to_string()),
            })
    })
}

/// Names that the format can hold, all different.
fn file_names(channels: &[(String, Vec<f32>)]) -> Vec<String> {
    const LONGEST: usize = 255;
    let mut taken = HashSet::new();
    let mut names = Vec::new();
    for (name, _) in channels {
        let plain = |c: char| {
            if c.is_ascii() && !c.is_ascii_control() {
                c
            } else {
                '_'
            }
        };
        let safe: String = name.chars().map(plain).collect();
        let mut candidate: String = safe.chars().take(LONGEST).collect();
        let mut number = 1;
        while candidate.is_empty() || !taken.insert(candidate.clone()) {
            number += 1;
            let ending = format!("-{number}");
            // Before the dot, so that the channel keeps its last letter.
            let (layer, channel) = safe.rsplit_once('.').unwrap_or((&safe, ""));
            let dot = if channel.is_empty() { "" } else { "." };
            let room = LONGEST.saturating_sub(ending.len() + dot.len() + channel.len());
            let layer: String = layer.chars().take(room).collect();
            candidate = format!("{layer}{ending}{dot}{channel}");
        }
        names.push(candidate);
    }
    names
}

/// Values that the writer takes from where they are.
struct Borrowed<'a> {
    width: usize,
    values: &'a [f32],
}

impl<'a> WritableSamples<'a> for Borrowed<'_> {
    type Writer = Lines<'a>;

    fn sample_type(&self) -> SampleType {
        SampleType::F32
    }

    fn infer_level_modes(&self) -> (LevelMode, RoundingMode) {
        (LevelMode::Singular, RoundingMode::Down)
    }

    fn create_samples_writer(&'a self, _: &Header) -> Lines<'a> {
        Lines {
            width: self.width,
            values: self.values,
        }
    }
}

struct Lines<'a> {
    width: usize,
    values: &'a [f32],
}

impl SamplesWriter for Lines<'_> {
    fn extract_line(&self, line: LineRefMut<'_>) {
        let position = line.location.position;
        let start = position.y() * self.width + position.x();
        let values = &self.values[start..start + line.location.sample_count];
        line.write_samples_from_slice(values)
            .expect("the line has room for its own samples");
    }
}

/// Reads all channels of all parts.
pub(super) fn read(path: &Path, bytes: &[u8]) -> Result<Image, Error> {
    let fail = |error: exr::error::Error| Error::malformed(path, "EXR data", error.to_string());
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(fail)?;
    check_size(path, &meta, bytes.len())?;
    let parts = meta.headers.len();
    let file = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .map_err(fail)?;
    let mut image = Image::default();
    for (index, layer) in file.layer_data.into_iter().enumerate() {
        let size = (layer.size.width(), layer.size.height());
        if index == 0 {
            (image.width, image.height) = size;
        } else if size != (image.width, image.height) {
            let cause = format!(
                "is {} x {} pixels, the first part {} x {}",
                size.0, size.1, image.width, image.height
            );
            return Err(Error::malformed(path, format!("part {}", index + 1), cause));
        }
        let prefix = match layer.attributes.layer_name {
            Some(name) if parts > 1 => format!("{name}."),
            _ => String::new(),
        };
        for channel in layer.channel_data.list {
            let values = match channel.sample_data {
                FlatSamples::F32(values) => values,
                other => other.values_as_f32().collect(),
            };
            image.channels.push((format!("{prefix}{}", channel.name), values));
        }
    }
    match image.fault() {
        Some(fault) => Err(Error::malformed(path, "EXR data", fault)),
        None => Ok(image),
    }
}

/// The header alone decides what is allocated, and it may be damaged.
fn check_size(path: &Path, meta: &MetaData, length: usize) -> Result<(), Error> {
    let mut needed = 0u64;
    for header in &meta.headers {
        if header.deep
            || matches!(header.blocks, BlockDescription::Tiles(t) if t.level_mode != LevelMode::Singular)
        {
            return Err(Error::malformed(
                path,
                "EXR header",
                "deep and multi-resolution pictures are not read",
            ));
        }
        let pixels = (header.layer_size.width() as u64).saturating_mul(header.layer_size.height() as u64);
        let channels = header.channels.list.len() as u64;
        needed = needed.saturating_add(pixels.saturating_mul(channels).saturating_mul(4));
    }
    let limit = decoded_limit(length);
    if needed > limit {
        return Err(Error::TooLarge {
            path: path.to_owned(),
            element: "the picture of the size in the header".to_owned(),
            needed: needed >> 20,
            limit: limit >> 20,
        });
    }
    Ok(())
}
