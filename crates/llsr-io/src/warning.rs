//! What was repaired, replaced, left out or ignored while reading.

use std::fmt;

/// Elements that a warning names before it only counts.
const NAMED: usize = 3;

/// Places among which it looks for different ones.
const SEARCHED: u64 = 64;

/// Something in a file that was not taken as it stands.
///
/// Shown as one sentence: what it is and what was done about it, the first few places, and how many there are.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Warning {
    /// What was found and what was done.
    pub kind: WarningKind,
    /// The first places, in the order of the file: a line, a material, a node, ...
    pub elements: Vec<String>,
    /// How often it was found, at least 1.
    pub count: u64,
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.kind.sentence(), self.elements.join(", "))?;
        match self.count.saturating_sub(self.elements.len() as u64) {
            0 => Ok(()),
            more => write!(f, " and {more} more"),
        }
    }
}

macro_rules! kinds {
    ($($(#[$doc:meta])* $name:ident => $sentence:literal,)*) => {
        /// The kinds of [`Warning`].
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        #[non_exhaustive]
        pub enum WarningKind {
            $($(#[$doc])* $name,)*
        }

        impl WarningKind {
            /// What was found and what was done about it.
            pub fn sentence(self) -> &'static str {
                match self {
                    $(Self::$name => $sentence,)*
                }
            }
        }
    };
}

kinds! {
    // Text and numbers
    /// Bytes that are no UTF-8.
    BadText => "text that is not UTF-8 had those bytes replaced",
    /// A statement that cannot be read.
    BadStatement => "statements that cannot be read were left out",
    /// NaN, infinite or beyond the limit of coordinates.
    BadVertex => "vertices that are not finite or beyond 1e15 m away were left out, and their triangles with them",
    /// A normal or texture coordinate that is not finite.
    BadAttribute => "normals or texture coordinates that are not finite were left out, for their whole mesh",
    /// An index that points nowhere.
    BadIndex => "faces with an index out of range were left out",
    /// The file uses a shading normal or texture coordinate that it does not have.
    BadAttributeIndex => "normals or texture coordinates with an index out of range, or missing at some corners of a face, were left out",
    /// Statements that mean nothing to a renderer of surfaces.
    Ignored => "not supported and ignored",
    // Geometry
    /// A polygon with fewer than three different corners.
    BadPolygon => "faces with fewer than three different corners were left out",
    /// A polygon whose corners do not lie in a plane.
    NonPlanarPolygon => "polygons out of plane were cut along the lines seen from their mean normal",
    /// A polygon whose outline crosses itself, encloses nothing or is too long.
    FannedPolygon => "polygons whose outline crosses itself or encloses nothing were cut as a fan from their first corner",
    /// Triangles with two equal corners.
    CollapsedTriangle => "triangles with two corners in one place were left out",
    /// Triangles whose corners lie on a line.
    Needle => "triangles without an area were kept for their neighbours' sake; they cannot be seen",
    /// A part without anything to draw.
    EmptyPart => "parts without triangles were left out",
    /// A part that could not be read.
    BadPart => "parts that cannot be read were left out",
    /// A transform that cannot be inverted or is not finite.
    BadTransform => "objects with a transform that is not finite or flattens them were left out",
    /// A node that is its own ancestor or has two parents.
    NodeGraph => "nodes that are reached twice or inside themselves were taken once",
    /// Scenes other than the one shown.
    OtherScenes => "only the file's default scene was read; left out",
    /// A mesh with skin, morph targets or instancing.
    RestPose => "taken in the rest pose, without skin, morph targets or animation",

    // Materials
    /// A material library that cannot be read.
    MissingMaterials => "material libraries that cannot be read were left out; their materials are grey",
    /// A material that is not defined.
    MissingMaterial => "materials that are used but not defined are grey",
    /// A texture that cannot be read.
    MissingTexture => "textures that cannot be read were left out; the plain colour stands in",
    /// Texture coordinates that a texture needs are missing.
    MissingCoordinates => "textures on meshes without texture coordinates show the colour of their corner",
    /// See-through materials.
    Transparency => "see-through materials are opaque here",
    /// A material number out of range.
    ClampedMaterial => "material numbers out of range were clamped",
    /// A kind of texture that is not used.
    UnusedTexture => "textures other than the base colour are not used",

    // Lights
    /// An emissive part that is no tube.
    DarkEmitter => "emissive parts that are no tubes give no light",
    /// A part of a `--tube` material that is no tube.
    NotATube => "parts of a tube material that are not long and thin stay ordinary geometry",
    /// A spot or directional light.
    UnsupportedLight => "spot and directional lights give no light here",
    /// A light with unusable numbers.
    BadLight => "lights with unusable numbers were left out or repaired",
    /// A linear light without a length.
    ShortLight => "linear lights without a length became point lights",
    /// A texture on an emissive tube.
    EmissiveTexture => "emissive textures of tubes were replaced by their mean",

    // Cameras
    /// A camera with unusable numbers.
    BadCamera => "cameras with unusable numbers were left out",
}

/// Collects warnings: one for each kind, however many places.
#[derive(Debug, Default)]
pub(crate) struct Warnings {
    list: Vec<Warning>,
}

impl Warnings {
    /// Notes one place; `element` is only made for the first few.
    pub(crate) fn add(&mut self, kind: WarningKind, element: impl FnOnce() -> String) {
        self.add_many(kind, 1, element);
    }

    /// Notes `count` places at once; nothing if there are none.
    pub(crate) fn add_many(&mut self, kind: WarningKind, count: u64, element: impl FnOnce() -> String) {
        if count == 0 {
            return;
        }
        let warning = match self.list.iter_mut().find(|w| w.kind == kind) {
            Some(warning) => warning,
            None => {
                self.list.push(Warning {
                    kind,
                    elements: Vec::new(),
                    count: 0,
                });
                self.list.last_mut().expect("just pushed")
            }
        };
        let before = warning.count;
        warning.count += count;
        // Places of the same name are named once, but not compared for ever.
        if warning.elements.len() < NAMED && before < SEARCHED {
            let element = shortened(element());
            if !warning.elements.contains(&element) {
                warning.elements.push(element);
            }
        }
    }

    /// Adds the other's places to these.
    pub(crate) fn merge(&mut self, other: Self) {
        for warning in other.list {
            match self.list.iter_mut().find(|w| w.kind == warning.kind) {
                Some(mine) => {
                    mine.count += warning.count;
                    let room = NAMED.saturating_sub(mine.elements.len());
                    mine.elements.extend(warning.elements.into_iter().take(room));
                }
                None => self.list.push(warning),
            }
        }
    }

    pub(crate) fn into_list(self) -> Vec<Warning> {
        self.list
    }
}

/// Control characters escaped, long text cut: names in files can be anything.
pub(crate) fn shortened(text: String) -> String {
    const LONGEST: usize = 120;
    let mut short: String = text
        .chars()
        .take(LONGEST)
        .flat_map(|c| {
            let (escape, plain) = if c.is_control() {
                (Some(c.escape_default()), None)
            } else {
                (None, Some(c))
            };
            escape.into_iter().flatten().chain(plain)
        })
        .collect();
    if text.chars().nth(LONGEST).is_some() {
        short.push('…');
    }
    short
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_sentence_for_each_kind_with_the_first_places() {
        let mut warnings = Warnings::default();
        warnings.add_many(WarningKind::Needle, 200, || "mesh a".to_owned());
        for i in 0..5 {
            warnings.add(WarningKind::BadIndex, || format!("line {}", i / 2));
            warnings.add_many(WarningKind::Needle, 0, || unreachable!("nothing to name"));
        }
        let list: Vec<String> = warnings.into_list().iter().map(ToString::to_string).collect();
        assert!(list[0].ends_with("seen: mesh a and 199 more"), "{}", list[0]);
        assert!(
            list[1].ends_with("left out: line 0, line 1, line 2 and 2 more"),
            "{}",
            list[1]
        );
    }

    #[test]
    fn names_from_files_stay_on_one_short_line() {
        let text = shortened(format!("a\nb\u{1b}[31m{}", "x".repeat(500)));
        assert!(
            text.starts_with("a\\nb\\u{1b}[31mx") && text.ends_with('…'),
            "{text}"
        );
        assert!(text.chars().count() < 140, "{} letters", text.chars().count());
    }
}
