//! Typed lists in buffers: everything about them is checked before the library follows an index or an offset.

use gltf::accessor::{DataType, Dimensions, Item, Iter};
use gltf::json::Root;
use gltf::json::accessor::{ComponentType, Type};
use gltf::json::validation::Checked;

use crate::error::Error;

/// Bytes that may be decoded from small files.
const FREE_BUDGET: u64 = 256 << 20;

/// Elements of a sparse accessor without a base, which costs no bytes in the file.
const MOST_ZEROS: usize = 1 << 24;

/// Reads accessors and keeps count of what that takes: a few bytes of JSON can ask for the same buffer again and again.
pub(super) struct Reader<'a> {
    pub(super) document: &'a gltf::Document,
    pub(super) buffers: &'a [Option<Vec<u8>>],
    budget: u64,
    used: u64,
}

impl<'a> Reader<'a> {
    pub(super) fn new(document: &'a gltf::Document, buffers: &'a [Option<Vec<u8>>]) -> Self {
        let bytes: usize = buffers.iter().flatten().map(Vec::len).sum();
        Self {
            document,
            buffers,
            budget: FREE_BUDGET + 8 * bytes as u64,
            used: 0,
        }
    }

    /// Books memory for what is about to be made.
    pub(super) fn book(&mut self, bytes: u64, path: &std::path::Path) -> Result<(), Error> {
        self.used = self.used.saturating_add(bytes);
        if self.used > self.budget {
            return Err(Error::TooLarge {
                path: path.to_owned(),
                element: "the meshes, which share their buffers too often,".to_owned(),
                needed: self.used >> 20,
                limit: self.budget >> 20,
            });
        }
        Ok(())
    }

    /// Number of elements, type and shape, if the accessor can be read.
    pub(super) fn facts(&self, index: usize) -> Result<Facts, String> {
        facts(self.document.as_json(), self.buffers, index)
            .map_err(|cause| format!("accessor {index}: {cause}"))
    }

    /// The elements of an accessor for which [`facts`](Self::facts) has given a type that matches `T`.
    pub(super) fn elements<T: Item>(&self, index: usize) -> Option<Iter<'a, T>> {
        let accessor = self.document.accessors().nth(index)?;
        let buffers = self.buffers;
        Iter::new(accessor, move |buffer| buffers.get(buffer.index())?.as_deref())
    }
}

/// What is known about a readable accessor.
#[derive(Clone, Copy, Debug)]
pub(super) struct Facts {
    pub(super) count: usize,
    pub(super) component: DataType,
    pub(super) dimensions: Dimensions,
    pub(super) normalized: bool,
    /// Whether reading it steps through all elements.
    pub(super) sparse: bool,
}

/// Checks all that the library takes for granted when it reads an accessor.
fn facts(root: &Root, buffers: &[Option<Vec<u8>>], index: usize) -> Result<Facts, String> {
    let accessor = root.accessors.get(index).ok_or("there is none of that number")?;
    let (Checked::Valid(component), Checked::Valid(dimensions)) = (accessor.component_type, accessor.type_)
    else {
        return Err("has an unknown type".to_owned());
    };
    let component = component.0;
    let size = component.size() * dimensions.multiplicity();
    let count = usize::try_from(accessor.count.0).map_err(|_| "is too long")?;
    if count == 0 || count > u32::MAX as usize {
        return Err(format!("has {count} elements"));
    }
    if let Some(view) = accessor.buffer_view {
        let offset = accessor.byte_offset.unwrap_or_default().0;
        check_range(root, buffers, view.value(), offset, count, size)?;
    } else if accessor.sparse.is_none() {
        return Err("has no data (compressed meshes are not supported)".to_owned());
    } else if count > MOST_ZEROS {
        return Err(format!("has {count} elements but hardly any data"));
    }
    if let Some(sparse) = &accessor.sparse {
        let changes = usize::try_from(sparse.count.0).unwrap_or(usize::MAX);
        if changes == 0 || changes > count {
            return Err(format!("replaces {changes} of {count} elements"));
        }
        let Checked::Valid(index_type) = sparse.indices.component_type else {
            return Err("has replaced elements of an unknown index type".to_owned());
        };
        let indices = &sparse.indices;
        check_range(
            root,
            buffers,
            indices.buffer_view.value(),
            indices.byte_offset.0,
            changes,
            index_type.0.size(),
        )?;
        check_range(
            root,
            buffers,
            sparse.values.buffer_view.value(),
            sparse.values.byte_offset.0,
            changes,
            size,
        )?;
    }
    Ok(Facts {
        count,
        component: match component {
            ComponentType::I8 => DataType::I8,
            ComponentType::U8 => DataType::U8,
            ComponentType::I16 => DataType::I16,
            ComponentType::U16 => DataType::U16,
            ComponentType::U32 => DataType::U32,
            ComponentType::F32 => DataType::F32,
        },
        dimensions: match dimensions {
            Type::Scalar => Dimensions::Scalar,
            Type::Vec2 => Dimensions::Vec2,
            Type::Vec3 => Dimensions::Vec3,
            Type::Vec4 => Dimensions::Vec4,
            Type::Mat2 => Dimensions::Mat2,
            Type::Mat3 => Dimensions::Mat3,
            Type::Mat4 => Dimensions::Mat4,
        },
        normalized: accessor.normalized,
        sparse: accessor.sparse.is_some(),
    })
}

/// Checks that `count` elements of `size` bytes from `offset` on lie in a view and the view in its buffer.
fn check_range(
    root: &Root,
    buffers: &[Option<Vec<u8>>],
    view_index: usize,
    offset: u64,
    count: usize,
    size: usize,
) -> Result<(), String> {
    let bytes = view_bytes(root, buffers, view_index)?;
    let stride = match root.buffer_views[view_index].byte_stride {
        Some(stride) if stride.0 < size || stride.0 > 252 => {
            return Err(format!(
                "buffer view {view_index} has a stride of {} bytes",
                stride.0
            ));
        }
        Some(stride) => stride.0,
        None => size,
    };
    let needed = ((count - 1) as u64)
        .checked_mul(stride as u64)
        .and_then(|n| n.checked_add(size as u64))
        .and_then(|n| n.checked_add(offset));
    match needed {
        Some(needed) if needed <= bytes.len() as u64 => Ok(()),
        _ => Err(format!(
            "{count} elements do not fit into buffer view {view_index} of {} bytes",
            bytes.len()
        )),
    }
}

/// The bytes of a buffer view.
pub(super) fn view_bytes<'a>(
    root: &Root,
    buffers: &'a [Option<Vec<u8>>],
    view_index: usize,
) -> Result<&'a [u8], String> {
    let view = root
        .buffer_views
        .get(view_index)
        .ok_or_else(|| format!("there is no buffer view {view_index}"))?;
    let buffer = view.buffer.value();
    let bytes = buffers
        .get(buffer)
        .and_then(Option::as_ref)
        .ok_or_else(|| format!("buffer {buffer} is missing"))?;
    let start = view.byte_offset.unwrap_or_default().0;
    let end = start
        .checked_add(view.byte_length.0)
        .and_then(|end| usize::try_from(end).ok());
    usize::try_from(start)
        .ok()
        .zip(end)
        .and_then(|(start, end)| bytes.get(start..end))
        .ok_or_else(|| {
            format!(
                "buffer view {view_index} reaches beyond the {} bytes of buffer {buffer}",
                bytes.len()
            )
        })
}
