//! Numbers out of buffers, sparse or not, with every length checked before anything is read.

use gltf::accessor::sparse::IndexType;
use gltf::accessor::{Accessor, DataType, Dimensions};
use gltf::buffer::View;

use super::buffers::Buffers;
use super::{Fault, fault, part};

/// Elements of an accessor that has no buffer at all, only zeros: a few letters of JSON may ask for thousands of
/// millions.
const MOST_ZEROS: usize = 1 << 24;

/// Vectors of `N` numbers; those that are normalised in 0..1 or -1..1.
pub(super) fn vectors<const N: usize>(
    buffers: &Buffers<'_>,
    accessor: &Accessor<'_>,
) -> Result<Vec<[f32; N]>, Fault> {
    let components = accessor.dimensions().multiplicity();
    let flat = !matches!(accessor.dimensions(), Dimensions::Mat2 | Dimensions::Mat3 | Dimensions::Mat4);
    if components < N || !flat {
        return fault(format!(
            "{}: vectors of {N} numbers are wanted here; export the scene again",
            called(accessor)
        ));
    }
    let (kind, normalised) = (accessor.data_type(), accessor.normalized());
    let size = component_size(kind);
    elements(buffers, accessor, size * components, |bytes| {
        std::array::from_fn(|k| number(&bytes[k * size..], kind, normalised))
    })
}

/// Whole numbers.
pub(super) fn indices(buffers: &Buffers<'_>, accessor: &Accessor<'_>) -> Result<Vec<u32>, Fault> {
    let kind = accessor.data_type();
    let whole = matches!(kind, DataType::U8 | DataType::U16 | DataType::U32);
    if accessor.dimensions() != Dimensions::Scalar || !whole {
        return fault(format!(
            "{}: indices must be unsigned whole numbers; export the scene again",
            called(accessor)
        ));
    }
    elements(buffers, accessor, component_size(kind), |bytes| match kind {
        DataType::U8 => bytes[0].into(),
        DataType::U16 => u16::from_le_bytes([bytes[0], bytes[1]]).into(),
        _ => u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]),
    })
}

fn called(accessor: &Accessor<'_>) -> String {
    part("accessors", accessor.index(), accessor.name())
}

fn component_size(kind: DataType) -> usize {
    match kind {
        DataType::I8 | DataType::U8 => 1,
        DataType::I16 | DataType::U16 => 2,
        DataType::U32 | DataType::F32 => 4,
    }
}

fn number(bytes: &[u8], kind: DataType, normalised: bool) -> f32 {
    let two = || [bytes[0], bytes[1]];
    let four = || [bytes[0], bytes[1], bytes[2], bytes[3]];
    let (value, greatest) = match kind {
        DataType::I8 => (f32::from(bytes[0] as i8), 127.0),
        DataType::U8 => (f32::from(bytes[0]), 255.0),
        DataType::I16 => (f32::from(i16::from_le_bytes(two())), 32_767.0),
        DataType::U16 => (f32::from(u16::from_le_bytes(two())), 65_535.0),
        DataType::U32 => (u32::from_le_bytes(four()) as f32, 1.0),
        DataType::F32 => return f32::from_le_bytes(four()),
    };
    if normalised { (value / greatest).max(-1.0) } else { value }
}

/// Each element of `size` bytes as `read` sees it, with the sparse ones put in their places.
fn elements<T: Copy>(
    buffers: &Buffers<'_>,
    accessor: &Accessor<'_>,
    size: usize,
    read: impl Fn(&[u8]) -> T,
) -> Result<Vec<T>, Fault> {
    let count = accessor.count();
    let mut all = match accessor.view() {
        Some(view) => {
            let stride = view.stride().unwrap_or(size).max(1);
            let stretch = Stretch { view, offset: accessor.offset(), stride, size, count };
            stretch.chunks(buffers, accessor)?.map(&read).collect()
        }
        None if count > MOST_ZEROS => {
            return fault(format!(
                "{}: {count} elements without a buffer are more than the {MOST_ZEROS} that are read",
                called(accessor)
            ));
        }
        None => vec![read(&[0; 64]); count],
    };
    if let Some(sparse) = accessor.sparse() {
        let (indices, values) = (sparse.indices(), sparse.values());
        let count = sparse.count();
        let index_size = match indices.index_type() {
            IndexType::U8 => 1,
            IndexType::U16 => 2,
            IndexType::U32 => 4,
        };
        let places = Stretch {
            view: indices.view(),
            offset: indices.offset(),
            stride: index_size,
            size: index_size,
            count,
        };
        let values = Stretch { view: values.view(), offset: values.offset(), stride: size, size, count };
        let values = values.chunks(buffers, accessor)?;
        for (place, value) in places.chunks(buffers, accessor)?.zip(values) {
            let place = place.iter().rev().fold(0, |place, &byte| place << 8 | usize::from(byte));
            match all.get_mut(place) {
                Some(element) => *element = read(value),
                None => {
                    return fault(format!(
                        "{}: its sparse index {place} is beyond its {} elements; export the scene again",
                        called(accessor),
                        accessor.count()
                    ));
                }
            }
        }
    }
    Ok(all)
}

/// Elements in a view: where they begin, how far they are apart, how long each is and how many.
struct Stretch<'a> {
    view: View<'a>,
    offset: usize,
    stride: usize,
    size: usize,
    count: usize,
}

impl Stretch<'_> {
    fn chunks<'b>(
        &self,
        buffers: &'b Buffers<'_>,
        accessor: &Accessor<'_>,
    ) -> Result<impl Iterator<Item = &'b [u8]> + use<'b>, Fault> {
        let &Self { offset, stride, size, count, .. } = self;
        let bytes = buffers.view(&self.view)?;
        let needed = match count {
            0 => Some(0),
            _ => (count - 1).checked_mul(stride).and_then(|b| b.checked_add(size)?.checked_add(offset)),
        };
        match needed {
            Some(needed) if needed <= bytes.len() => {
                Ok((0..count).map(move |k| &bytes[offset + k * stride..][..size]))
            }
            _ => fault(format!(
                "{}: its {count} elements reach beyond {}, which has {} bytes; the file is damaged: export it again",
                called(accessor),
                part("bufferViews", self.view.index(), self.view.name()),
                bytes.len()
            )),
        }
    }
}
