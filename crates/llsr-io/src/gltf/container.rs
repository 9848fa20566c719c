//! From bytes to JSON structures and buffers, with nothing believed that was not checked.

use std::collections::HashSet;
use std::path::Path;

use base64::Engine as _;
use gltf::json::Root;
use serde::Deserialize;

use crate::error::Error;
use crate::files;
use crate::warning::{WarningKind, Warnings};

/// The JSON text and binary chunk of a file.
pub(super) struct Container {
    pub(super) json: Vec<u8>,
    pub(super) blob: Option<Vec<u8>>,
}

/// Splits a binary file; takes any other as JSON.
pub(super) fn split(path: &Path, mut bytes: Vec<u8>) -> Result<Container, Error> {
    if !bytes.starts_with(b"glTF") {
        return Ok(Container {
            json: bytes,
            blob: None,
        });
    }
    let damaged = |cause: &str| Error::malformed(path, "GLB header", cause);
    let length = bytes
        .get(8..12)
        .and_then(|field| field.try_into().ok())
        .map(u32::from_le_bytes);
    // The library subtracts the header's size without a look.
    match length {
        None => return Err(damaged("the file ends inside it")),
        Some(length) if length < 20 => return Err(damaged("its length field is too small")),
        Some(length) if length as usize > bytes.len() => {
            let cause = format!("says {length} bytes, the file has {}: it is cut off", bytes.len());
            return Err(damaged(&cause));
        }
        Some(_) => {}
    }
    let glb = gltf::Glb::from_slice(&bytes).map_err(|error| {
        let cause = match error {
            gltf::Error::Binary(error) => error.to_string(),
            other => other.to_string(),
        };
        Error::malformed(path, "GLB chunks", cause)
    })?;
    let json = glb.json.into_owned();
    let binary = glb.bin.map(|bin| bin.len());
    // The binary chunk may be all of the memory that there is: it stays where it is, behind both heads and the JSON.
    let blob = binary.map(|length| {
        bytes.drain(..12 + 8 + json.len() + 8);
        bytes.truncate(length);
        bytes
    });
    Ok(Container { json, blob })
}

/// Numbers that the library would round to single precision.
#[derive(Debug, Default, Deserialize)]
pub(super) struct Precise {
    #[serde(default)]
    pub(super) nodes: Vec<PreciseNode>,
}

/// A node's transform as written.
#[derive(Debug, Default, Deserialize)]
pub(super) struct PreciseNode {
    pub(super) translation: Option<[f64; 3]>,
    pub(super) rotation: Option<[f64; 4]>,
    pub(super) scale: Option<[f64; 3]>,
    pub(super) matrix: Option<[f64; 16]>,
}

/// Reads the JSON text twice: for the library and for exact numbers.
pub(super) fn parse(path: &Path, json: &[u8]) -> Result<(Root, Precise), Error> {
    let json = json.strip_prefix(b"\xef\xbb\xbf").unwrap_or(json);
    check_density(path, json)?;
    let fail = |error: serde_json::Error| Error::malformed(path, "glTF JSON", error.to_string());
    let root = serde_json::from_slice(json).map_err(fail)?;
    let precise = serde_json::from_slice(json).map_err(fail)?;
    Ok((root, precise))
}

/// A few bytes of JSON (`{},{},...`) become hundreds of bytes of structures, so their number is bounded first.
fn check_density(path: &Path, json: &[u8]) -> Result<(), Error> {
    /// Structures that any file may have, whatever its size.
    const ALLOWED: usize = 300_000;
    /// Structures that mean something take more bytes than this.
    const BYTES_EACH: usize = 24;
    /// Bytes outside of strings.
    const MOST_STRUCTURE: usize = 256 << 20;
    let (mut structures, mut outside) = (0usize, 0usize);
    let (mut in_string, mut escaped) = (false, false);
    for &byte in json {
        if in_string {
            in_string = byte != b'"' || escaped;
            escaped = byte == b'\\' && !escaped;
            continue;
        }
        outside += 1;
        match byte {
            b'"' => in_string = true,
            b'{' | b'[' => structures += 1,
            _ => {}
        }
    }
    if outside > MOST_STRUCTURE {
        return Err(Error::TooLarge {
            path: path.to_owned(),
            element: "the JSON structure".to_owned(),
            needed: outside as u64 >> 20,
            limit: MOST_STRUCTURE as u64 >> 20,
        });
    }
    if structures > ALLOWED && json.len() / structures < BYTES_EACH {
        let cause = format!(
            "has {structures} objects and lists in {} bytes: nearly all of them are empty",
            json.len()
        );
        return Err(Error::malformed(path, "glTF JSON", cause));
    }
    Ok(())
}

/// Extensions that may be required although nothing is done about them: they only change how surfaces look.
const APPEARANCE: &[&str] = &[
    "KHR_materials_",
    "KHR_texture_basisu",
    "EXT_texture_webp",
    "EXT_texture_avif",
];

/// Extensions that are understood.
const KNOWN: &[&str] = &[
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_unlit",
    "KHR_texture_transform",
];

/// Refuses files that cannot be shown without an unknown extension.
pub(super) fn check_extensions(path: &Path, root: &Root, warnings: &mut Warnings) -> Result<(), Error> {
    for name in &root.extensions_required {
        if KNOWN.contains(&name.as_str()) {
            continue;
        }
        if APPEARANCE.iter().any(|prefix| name.starts_with(prefix)) {
            warnings.add(WarningKind::Ignored, || format!("extension {name}"));
            continue;
        }
        let help = if name.contains("draco") || name.contains("meshopt") || name.contains("quantization") {
            "export it without mesh compression"
        } else {
            "export it without this extension"
        };
        let cause = format!("the file cannot be read without {name:?}, which is not supported: {help}");
        return Err(Error::malformed(path, "extensionsRequired", cause));
    }
    let required: HashSet<&String> = root.extensions_required.iter().collect();
    for name in &root.extensions_used {
        if !required.contains(name) && !KNOWN.contains(&name.as_str()) {
            warnings.add(WarningKind::Ignored, || format!("extension {name}"));
        }
    }
    Ok(())
}

/// The bytes of each buffer; `None` where they cannot be had.
pub(super) fn buffers(
    path: &Path,
    root: &Root,
    mut blob: Option<Vec<u8>>,
    warnings: &mut Warnings,
) -> Vec<Option<Vec<u8>>> {
    let mut total = 0u64;
    let mut list = Vec::with_capacity(root.buffers.len());
    for (index, buffer) in root.buffers.iter().enumerate() {
        let bytes = match &buffer.uri {
            None if index == 0 => blob
                .take()
                .ok_or_else(|| "the file has no binary chunk".to_owned()),
            None => Err("has no data".to_owned()),
            Some(uri) => resolve(path, uri, files::LARGEST_FILE.saturating_sub(total)),
        };
        let bytes = bytes.map(|mut bytes| {
            let length = usize::try_from(buffer.byte_length.0).unwrap_or(usize::MAX);
            // A binary chunk may be padded.
            if bytes.len() < length {
                warnings.add(WarningKind::BadPart, || {
                    format!(
                        "end of buffer {index}: {} of {length} bytes are there",
                        bytes.len()
                    )
                });
            }
            bytes.truncate(length);
            bytes
        });
        match bytes {
            Ok(bytes) => {
                total += bytes.len() as u64;
                list.push(Some(bytes));
            }
            Err(cause) => {
                warnings.add(WarningKind::BadPart, || format!("buffer {index}: {cause}"));
                list.push(None);
            }
        }
    }
    list
}

/// The bytes behind a URI: embedded, or a file below the directory of `path`.
pub(super) fn resolve(path: &Path, uri: &str, limit: u64) -> Result<Vec<u8>, String> {
    if let Some(rest) = uri.strip_prefix("data:") {
        let (head, data) = rest.split_once(',').ok_or("data URI without data")?;
        if !head.ends_with(";base64") {
            return Err("data URI that is not base64".to_owned());
        }
        // Padding is often left away.
        let engine = base64::engine::GeneralPurpose::new(
            &base64::alphabet::STANDARD,
            base64::engine::GeneralPurposeConfig::new()
                .with_decode_padding_mode(base64::engine::DecodePaddingMode::Indifferent),
        );
        return engine.decode(data).map_err(|error| format!("data URI: {error}"));
    }
    let name = percent_decoded(uri).ok_or_else(|| format!("{uri:?} is no file name"))?;
    let file = files::beside(files::directory_of(path), &name)
        .ok_or_else(|| format!("{name:?} is not a file below the scene's folder"))?;
    files::read(&file, limit).map_err(|error| format!("{name:?}: {}", error.brief()))
}

/// `%20` and the like as the bytes they stand for.
fn percent_decoded(uri: &str) -> Option<String> {
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.bytes();
    while let Some(byte) = rest.next() {
        if byte == b'%' {
            let digits = [rest.next()?, rest.next()?];
            let text = std::str::from_utf8(&digits).ok()?;
            bytes.push(u8::from_str_radix(text, 16).ok()?);
        } else {
            bytes.push(byte);
        }
    }
    String::from_utf8(bytes).ok()
}
