//! What is wrong with a scene as far as its edges go.

use std::fmt;

use crate::EdgeReport;

/// Something that has no edges, or whose edges needed a repair.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum EdgeWarning {
    /// A mesh with an index out of range, a coordinate that is not finite or lists of different lengths has no edges.
    InvalidMesh {
        /// Name of the mesh.
        mesh: String,
    },
    /// An object whose mesh does not exist has no edges.
    MissingMesh {
        /// Name of the object.
        object: String,
    },
    /// A primitive without extent, or with numbers that are not finite, has no edges.
    BadPrimitive {
        /// Name of the object.
        object: String,
    },
    /// An object whose transform has no finite inverse has no edges.
    BadTransform {
        /// Name of the object.
        object: String,
    },
    /// A mesh with defects; its edges are found all the same.
    Repaired {
        /// Name of the mesh.
        mesh: String,
        /// How many of each.
        report: EdgeReport,
    },
}

impl EdgeWarning {
    /// A warning if the report names a defect; open meshes are none.
    pub(super) fn of_report(mesh: String, report: EdgeReport) -> Option<Self> {
        let defects =
            report.collapsed_faces + report.flat_faces + report.non_manifold_edges + report.flipped_edges;
        (defects > 0).then_some(Self::Repaired { mesh, report })
    }
}

impl fmt::Display for EdgeWarning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::InvalidMesh { mesh } => write!(
                f,
                "mesh '{mesh}' has no edges: an index is out of range or a coordinate is not finite"
            ),
            Self::MissingMesh { object } => {
                write!(f, "object '{object}' has no edges: its mesh does not exist")
            }
            Self::BadPrimitive { object } => {
                write!(
                    f,
                    "object '{object}' has no edges: a primitive without usable extent"
                )
            }
            Self::BadTransform { object } => {
                write!(
                    f,
                    "object '{object}' has no edges: its transform has no finite inverse"
                )
            }
            Self::Repaired { mesh, report } => {
                write!(f, "mesh '{mesh}':")?;
                let defects = [
                    (report.collapsed_faces, "faces with equal corners left out"),
                    (report.flat_faces, "faces without area joined across"),
                    (report.non_manifold_edges, "edges of more than two faces"),
                    (
                        report.flipped_edges,
                        "edges whose faces are turned against each other",
                    ),
                ];
                let named = defects.iter().filter(|defect| defect.0 > 0);
                for (i, (count, what)) in named.enumerate() {
                    write!(f, "{} {count} {what}", if i > 0 { "," } else { "" })?;
                }
                Ok(())
            }
        }
    }
}
