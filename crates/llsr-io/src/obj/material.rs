//! MTL: the statements that a diffuse and glossy renderer needs.
//!
//! Each material's text is checked before tobj reads it, one material at a time: tobj panics on a colour with fewer
//! than three numbers and gives up a whole library for one bad line.

use std::collections::{HashMap, HashSet};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use glam::{Mat3, Vec3};
use llsr_scene::{Material, MaterialId, TextureId, TextureUse, Wrap};

use super::clean::{Cleaned, statements};
use crate::error::Error;
use crate::files;
use crate::import::Import;
use crate::texture::Decoder;
use crate::warning::{WarningKind, Warnings};

/// Reflectance of what has no (readable) material.
const GREY: f32 = 0.8;

/// Ids of the materials that an OBJ file uses.
pub(super) struct MaterialIds {
    ids: Vec<MaterialId>,
    default: MaterialId,
}

impl MaterialIds {
    /// The material of faces after `usemtl` number `used`, or of faces before the first one.
    pub(super) fn of(&self, used: Option<usize>) -> MaterialId {
        used.map_or(self.default, |index| self.ids[index])
    }
}

/// Reads the libraries and adds the materials that faces use to `import`.
pub(super) fn read(
    path: &Path,
    cleaned: &Cleaned,
    import: &mut Import,
    warnings: &mut Warnings,
) -> Result<MaterialIds, Error> {
    let directory = files::directory_of(path);
    let mut found: HashMap<String, (Material, Option<TextureStatement>)> = HashMap::new();
    let mut known = HashSet::new();
    for (names, line) in &cleaned.libraries {
        for (library, text) in open(directory, names, *line, &mut known, warnings) {
            parse(&library, &text, &mut found, warnings);
        }
    }
    let mut textures = Textures {
        directory,
        decoder: Decoder::default(),
        known: HashMap::new(),
    };
    let used = cleaned.buckets.iter().filter_map(|bucket| bucket.material);
    let mut needed = vec![false; cleaned.materials.len()];
    used.for_each(|index| needed[index] = true);
    let mut ids = Vec::new();
    for (index, name) in cleaned.materials.iter().enumerate() {
        let material = match found.get(name) {
            Some((material, texture)) => {
                let mut material = material.clone();
                if let (Some(statement), true) = (texture, needed[index]) {
                    material.base_color_texture = textures.load(name, statement, import, warnings);
                }
                material
            }
            None => {
                let line = cleaned.material_lines[index];
                if !cleaned.libraries.is_empty() || needed[index] {
                    warnings.add(WarningKind::MissingMaterial, || format!("{name} (line {line})"));
                }
                Material::diffuse(name.clone(), Vec3::splat(GREY))
            }
        };
        import.materials.push(material);
        ids.push(MaterialId::from(import.materials.len() - 1));
    }
    let default = MaterialId::from(import.materials.len());
    if cleaned.buckets.iter().any(|bucket| bucket.material.is_none()) {
        import.materials.push(Material::diffuse("", Vec3::splat(GREY)));
    }
    Ok(MaterialIds { ids, default })
}

/// The texts of the libraries that one `mtllib` statement names and that are not yet `known`: one file with blanks in
/// its name, or several files.
fn open(
    directory: &Path,
    names: &str,
    line: u32,
    known: &mut HashSet<PathBuf>,
    warnings: &mut Warnings,
) -> Vec<(PathBuf, Vec<u8>)> {
    /// No library of honest size comes near this (bytes).
    const LARGEST: u64 = 64 << 20;
    let read = |name: &str| match files::beside(directory, name) {
        None => Err("lies outside the folder of the OBJ file".to_owned()),
        Some(file) => match files::read(&file, LARGEST) {
            Ok(text) => Ok((file, text)),
            Err(error) => Err(error.brief()),
        },
    };
    let whole = read(names);
    let whole_name = names;
    // A blank may be escaped to show that it belongs to a name.
    let names: Vec<String> = names
        .replace("\\ ", "\0")
        .split_whitespace()
        .map(|name| name.replace('\0', " "))
        .collect();
    let found = match whole {
        Ok(library) => vec![Ok(library)],
        Err(cause) if names.len() == 1 => vec![Err((whole_name.to_owned(), cause))],
        Err(_) => names
            .into_iter()
            .map(|name| read(&name).map_err(|cause| (name, cause)))
            .collect(),
    };
    let mut texts = Vec::new();
    for library in found {
        match library {
            Ok((file, text)) => {
                if known.insert(file.clone()) {
                    texts.push((file, text));
                }
            }
            Err((name, cause)) => {
                warnings.add(WarningKind::MissingMaterials, || {
                    format!("line {line}: {name}: {cause}")
                });
            }
        }
    }
    texts
}

/// `map_Kd` and its options.
#[derive(Clone, Debug)]
struct TextureStatement {
    place: String,
    file: String,
    scale: [f32; 2],
    offset: [f32; 2],
    clamp: bool,
}

type Found = HashMap<String, (Material, Option<TextureStatement>)>;

/// Reads one library.
fn parse(library: &Path, text: &[u8], found: &mut Found, warnings: &mut Warnings) {
    let file = library
        .file_name()
        .unwrap_or_default()
        .to_string_lossy()
        .into_owned();
    let mut block = String::new();
    let mut texture = None;
    let mut name: Option<String> = None;
    let mut notes = Warnings::default();
    let mut text_notes = Warnings::default();
    let mut finish =
        |name: &mut Option<String>, block: &mut String, texture: &mut Option<TextureStatement>| {
            if let Some(name) = name.take() {
                // The first definition counts.
                found
                    .entry(name.clone())
                    .or_insert_with(|| (convert(name, block), texture.take()));
            }
            block.clear();
            *texture = None;
        };
    statements(
        text,
        |line, statement| {
            let (keyword, rest) = statement
                .split_once(|c: char| c.is_ascii_whitespace())
                .unwrap_or((&statement, ""));
            let place = || format!("{file} line {line}: {keyword} {}", rest.trim());
            let data = rest.split('#').next().unwrap_or("");
            let numbers: Vec<f32> = data
                .split_ascii_whitespace()
                .map_while(|t| t.parse().ok())
                .collect();
            let bounded = |value: f32, most: f32, notes: &mut Warnings| {
                if !(0.0..=most).contains(&value) {
                    notes.add(WarningKind::ClampedMaterial, place);
                }
                if value.is_nan() {
                    0.0
                } else {
                    value.clamp(0.0, most)
                }
            };
            if keyword == "newmtl" {
                finish(&mut name, &mut block, &mut texture);
                name = Some(rest.trim().to_owned());
                return;
            }
            if name.is_none() {
                notes.add(WarningKind::BadStatement, place);
                return;
            }
            match keyword {
                "Kd" | "Ks" | "Ke" => {
                    // One number stands for three.
                    let color = match numbers[..] {
                        [r, g, b, ..] => [r, g, b],
                        [grey] => [grey; 3],
                        _ => {
                            notes.add(WarningKind::BadStatement, place);
                            return;
                        }
                    };
                    let most = if keyword == "Ke" { f32::MAX } else { 1.0 };
                    let [r, g, b] = color.map(|c| bounded(c, most, &mut notes));
                    writeln!(block, "{keyword} {r} {g} {b}").expect("writing to a string");
                }
                "Ns" | "illum" | "Pr" | "Pm" | "d" | "Tr" => {
                    // "d -halo 0.5" and the like.
                    let number = data
                        .split_ascii_whitespace()
                        .last()
                        .and_then(|t| t.parse::<f32>().ok());
                    let Some(number) = number else {
                        notes.add(WarningKind::BadStatement, place);
                        return;
                    };
                    let most = match keyword {
                        "Ns" => 1e6,
                        "illum" => 10.0,
                        _ => 1.0,
                    };
                    let number = bounded(number, most, &mut notes);
                    match keyword {
                        "d" | "Tr" => {
                            let opacity = if keyword == "d" { number } else { 1.0 - number };
                            if opacity < 1.0 {
                                let name = name.clone().unwrap_or_default();
                                notes.add(WarningKind::Transparency, || format!("material {name:?}"));
                            }
                        }
                        "illum" => writeln!(block, "illum {}", number as u8).expect("writing to a string"),
                        _ => writeln!(block, "{keyword} {number}").expect("writing to a string"),
                    }
                }
                "map_Kd" => match texture_statement(rest) {
                    Some(statement) => {
                        texture = Some(TextureStatement {
                            place: format!("{file} line {line}"),
                            ..statement
                        })
                    }
                    None => notes.add(WarningKind::BadStatement, place),
                },
                _ if keyword.starts_with("map_")
                    || matches!(keyword, "bump" | "norm" | "disp" | "decal" | "refl") =>
                {
                    notes.add(WarningKind::UnusedTexture, place);
                }
                // Ambient colour, refraction and other terms that this renderer does not have.
                _ => {}
            }
        },
        &mut text_notes,
    );
    finish(&mut name, &mut block, &mut texture);
    warnings.merge(notes);
    warnings.merge(text_notes);
}

/// A material of checked statements.
fn convert(name: String, block: &str) -> Material {
    // The name stays out: tobj would trim it and take an empty one for an error.
    let text = format!("newmtl m\n{block}");
    let source = match tobj::load_mtl_buf(&mut text.as_bytes()) {
        Ok((mut list, _)) => list.pop().unwrap_or_default(),
        Err(_) => tobj::Material::default(),
    };
    let color = |c: Option<[f64; 3]>, default: f32| {
        c.map_or(Vec3::splat(default), |c| Vec3::from_array(c.map(|c| c as f32)))
    };
    let number = |key: &str| {
        source
            .unknown_param
            .get(key)
            .and_then(|text| text.parse::<f32>().ok())
    };
    let shiny = source.illumination_model.is_none_or(|model| model >= 2)
        && source.specular.is_none_or(|specular| specular != [0.0; 3]);
    // Blinn's exponent n matches a microfacet slope of alpha = sqrt(2 / (n + 2)), and roughness is its root.
    let from_exponent = source
        .shininess
        .filter(|_| shiny)
        .map(|n| (2.0 / (n + 2.0)).powf(0.25) as f32);
    Material {
        name,
        base_color: color(source.diffuse, GREY),
        base_color_texture: None,
        metallic: number("Pm").unwrap_or(0.0),
        roughness: number("Pr").or(from_exponent).unwrap_or(1.0),
        emission: color(source.emissive, 0.0),
    }
}

/// Splits `-option values... file name`.
fn texture_statement(rest: &str) -> Option<TextureStatement> {
    let mut statement = TextureStatement {
        place: String::new(),
        file: String::new(),
        scale: [1.0; 2],
        offset: [0.0; 2],
        clamp: false,
    };
    let mut rest = rest.trim();
    while rest.starts_with('-') {
        let (option, mut tail) = next_word(rest)?;
        // How many words may follow; numbers end at the first word that is none.
        let numbers = |tail: &mut &str, most: usize| {
            let mut list = Vec::new();
            while list.len() < most {
                match next_word(tail).and_then(|(word, after)| Some((word.parse::<f32>().ok()?, after))) {
                    Some((number, after)) if !after.is_empty() => {
                        list.push(number);
                        *tail = after;
                    }
                    _ => break,
                }
            }
            list
        };
        match option {
            "-s" | "-o" | "-t" => {
                let values = numbers(&mut tail, 3);
                let target = match option {
                    "-s" => &mut statement.scale,
                    "-o" => &mut statement.offset,
                    _ => &mut [0.0; 2],
                };
                for (target, value) in target.iter_mut().zip(values) {
                    *target = value;
                }
            }
            "-mm" => drop(numbers(&mut tail, 2)),
            "-bm" | "-boost" | "-texres" => drop(numbers(&mut tail, 1)),
            "-clamp" => {
                let (word, after) = next_word(tail)?;
                statement.clamp = word == "on";
                tail = after;
            }
            "-blendu" | "-blendv" | "-cc" | "-imfchan" | "-type" | "-colorspace" => tail = next_word(tail)?.1,
            _ => break,
        }
        rest = tail;
    }
    let finite = statement
        .scale
        .iter()
        .chain(&statement.offset)
        .all(|x| x.is_finite());
    statement.file = rest.trim_matches('"').to_owned();
    (finite && !statement.file.is_empty()).then_some(statement)
}

fn next_word(text: &str) -> Option<(&str, &str)> {
    let text = text.trim_start();
    let end = text.find(|c: char| c.is_ascii_whitespace()).unwrap_or(text.len());
    (end > 0).then(|| (&text[..end], text[end..].trim_start()))
}

/// Loads each file once.
struct Textures<'a> {
    directory: &'a Path,
    decoder: Decoder,
    known: HashMap<(String, bool), Option<TextureId>>,
}

impl Textures<'_> {
    fn load(
        &mut self,
        material: &str,
        statement: &TextureStatement,
        import: &mut Import,
        warnings: &mut Warnings,
    ) -> Option<TextureUse> {
        let key = (statement.file.clone(), statement.clamp);
        let texture = match self.known.get(&key) {
            Some(texture) => *texture,
            None => {
                let texture = match self.decode(statement) {
                    Ok(texture) => {
                        import.textures.push(texture);
                        Some(TextureId::from(import.textures.len() - 1))
                    }
                    Err(cause) => {
                        warnings.add(WarningKind::MissingTexture, || {
                            format!(
                                "{} (material {material:?}, {}): {cause}",
                                statement.file, statement.place
                            )
                        });
                        None
                    }
                };
                self.known.insert(key, texture);
                texture
            }
        }?;
        // With v' = 1 - v in mesh and texture: 1 - (s (1 - v') + o) = s v' + (1 - s - o).
        let ([su, sv], [ou, ov]) = (statement.scale, statement.offset);
        let transform = Mat3::from_cols(
            Vec3::new(su, 0.0, 0.0),
            Vec3::new(0.0, sv, 0.0),
            Vec3::new(ou, 1.0 - sv - ov, 1.0),
        );
        Some(TextureUse { texture, transform })
    }

    fn decode(&mut self, statement: &TextureStatement) -> Result<llsr_scene::Texture, String> {
        /// Bytes of one image file.
        const LARGEST: u64 = 256 << 20;
        let wrap = if statement.clamp {
            [Wrap::Clamp; 2]
        } else {
            [Wrap::Repeat; 2]
        };
        // Paths of another machine: a file of that name beside the OBJ is what was meant.
        let base = statement.file.rsplit(['/', '\\']).next().unwrap_or_default();
        let candidates = [
            files::beside(self.directory, &statement.file),
            files::beside(self.directory, base),
        ];
        let mut cause = "lies outside the folder of the OBJ file".to_owned();
        for file in candidates.into_iter().flatten() {
            match files::read(&file, LARGEST) {
                Ok(bytes) => return self.decoder.decode(&statement.file, &bytes, wrap),
                Err(error) => cause = error.brief(),
            }
        }
        Err(cause)
    }
}
