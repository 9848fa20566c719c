//! Line drawings: their layers, and what they are written as.

mod flat;
mod obj;
mod overlay;
mod shadows;
mod svg;

use glam::DVec3;
use llsr_edges::{EdgeClass, Line};

pub(crate) use flat::{FlatLine, flatten};
pub(crate) use obj::obj;
pub(crate) use overlay::overlay;
pub(crate) use shadows::{Shadows, UNIMPORTANT};
pub(crate) use svg::svg;

/// Why a line is drawn: a layer of the drawing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Layer {
    Penumbral,
    Umbral,
    Hard,
    Crease,
    Boundary,
    Silhouette,
}

impl Layer {
    /// From the lowest to the topmost.
    pub(crate) const ALL: [Self; 6] = [
        Self::Penumbral,
        Self::Umbral,
        Self::Hard,
        Self::Crease,
        Self::Boundary,
        Self::Silhouette,
    ];

    /// Name of the class in files and reports.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Penumbral => "penumbral",
            Self::Umbral => "umbral",
            Self::Hard => "hard",
            Self::Crease => EdgeClass::Crease.name(),
            Self::Boundary => EdgeClass::Boundary.name(),
            Self::Silhouette => EdgeClass::Silhouette.name(),
        }
    }

    /// Name of the layer for people.
    fn label(self) -> &'static str {
        match self {
            Self::Penumbral => "penumbral shadow edges",
            Self::Umbral => "umbral shadow edges",
            Self::Hard => "hard shadow edges",
            Self::Crease => "creases",
            Self::Boundary => "boundaries",
            Self::Silhouette => "silhouettes",
        }
    }

    /// Colour (sRGB) and width of the line in pixels of a picture 512 pixels high.
    fn style(self) -> ([u8; 3], f64) {
        match self {
            Self::Penumbral => ([0xd9, 0x8a, 0x3d], 0.7),
            Self::Umbral => ([0xa3, 0x3b, 0x20], 0.9),
            Self::Hard => ([0x7a, 0x1f, 0x3d], 0.9),
            Self::Crease => ([0x4a, 0x5a, 0x68], 0.8),
            Self::Boundary => ([0x1f, 0x3f, 0x66], 1.1),
            Self::Silhouette => ([0x10, 0x10, 0x10], 1.6),
        }
    }

    /// Position in [`ALL`](Self::ALL).
    pub(crate) fn index(self) -> usize {
        self as usize
    }
}

impl From<EdgeClass> for Layer {
    fn from(class: EdgeClass) -> Self {
        match class {
            EdgeClass::Silhouette => Self::Silhouette,
            EdgeClass::Crease => Self::Crease,
            EdgeClass::Boundary => Self::Boundary,
        }
    }
}

/// A line of a drawing in space.
#[derive(Clone, Debug)]
pub(crate) struct DrawnLine {
    pub(crate) layer: Layer,
    pub(crate) hidden: bool,
    pub(crate) closed: bool,
    /// Its points (m, recentred frame).
    pub(crate) points: Vec<DVec3>,
}

impl DrawnLine {
    /// Groups count objects within layers.
    pub(crate) fn new(line: Line, objects: usize) -> Self {
        Self {
            layer: Layer::ALL[line.group as usize / objects.max(1)],
            hidden: line.hidden,
            closed: line.closed,
            points: line.points,
        }
    }
}
