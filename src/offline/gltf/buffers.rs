//! Numbers out of accessors, buffer views and buffers. The `gltf` crate's own readers stop the process where these three
//! contradict each other; this one says so.

use crate::offline::error::Result;
use crate::offline::gltf::document::Document;
use gltf::json::accessor::{Accessor, ComponentType, GenericComponentType, IndexComponentType, Type};
use gltf::json::validation::Checked;
use gltf::json::{Index, buffer};

/// A number of type `kind` at the start of `bytes`, which is long enough; integers scaled to [-1, 1] if `normalized`
/// (glTF 2.0 specification, section 3.11).
fn component(bytes: &[u8], kind: ComponentType, normalized: bool) -> f64 {
    let first = |n: usize| bytes.iter().take(n).rev().fold(0_u32, |all, byte| all << 8 | u32::from(*byte));
    let (value, most) = match kind {
        ComponentType::I8 => (f64::from(first(1) as u8 as i8), 127.0),
        ComponentType::U8 => (f64::from(first(1)), 255.0),
        ComponentType::I16 => (f64::from(first(2) as u16 as i16), 32_767.0),
        ComponentType::U16 => (f64::from(first(2)), 65_535.0),
        ComponentType::U32 => (f64::from(first(4)), f64::from(u32::MAX)),
        ComponentType::F32 => return f64::from(f32::from_bits(first(4))),
    };
    if normalized { (value / most).max(-1.0) } else { value }
}

/// `count` elements of `size` bytes at `offset` of a view, `stride` apart.
struct Span {
    offset: u64,
    stride: u64,
    size: u64,
    count: u64,
}

impl Document<'_> {
    /// The bytes of a buffer view.
    pub fn view(&self, index: Index<buffer::View>) -> Result<&[u8]> {
        let field = || format!("bufferViews[{}]", index.value());
        let view = self.root.get(index).ok_or_else(|| self.error(field(), "an existing view", "none"))?;
        let buffer = self.buffers.get(view.buffer.value()).ok_or_else(|| self.error(field(), "an existing buffer", "none"))?;
        let (offset, length) = (view.byte_offset.unwrap_or_default().0, view.byte_length.0);
        let bytes = usize::try_from(offset).ok().and_then(|offset| buffer.get(offset..)?.get(..usize::try_from(length).ok()?));
        let expected = || format!("a part of the buffer's {} bytes", buffer.len());
        bytes.ok_or_else(|| self.error(field(), expected(), format!("{length} bytes at {offset}")))
    }

    /// An iterator over the elements of a view.
    fn elements(&self, field: &str, index: Index<buffer::View>, span: &Span) -> Result<impl Iterator<Item = &[u8]>> {
        let bytes = self.view(index)?;
        let length = span.count.checked_sub(1).and_then(|gaps| gaps.checked_mul(span.stride)?.checked_add(span.size));
        let end = span.offset.checked_add(length.unwrap_or(0));
        let fits = span.count == 0 || (length.is_some() && end.is_some_and(|end| end <= bytes.len() as u64));
        if !fits || span.stride < span.size {
            let got = format!("{} elements of {} bytes, {} apart, from {}", span.count, span.size, span.stride, span.offset);
            return Err(self.error(field, format!("what a view of {} bytes holds", bytes.len()), got));
        }
        // All within usize, as the view is.
        let (offset, stride, size) = (span.offset as usize, span.stride as usize, span.size as usize);
        let all = bytes.get(offset..).unwrap_or_default().chunks(stride.max(1)).take(span.count as usize);
        Ok(all.map(move |chunk| chunk.get(..size).unwrap_or_default()))
    }

    /// The elements of an accessor that must be of type `kind`, with `N` components of one of `components`.
    pub fn elements_of<const N: usize>(
        &self,
        index: Index<Accessor>,
        kind: Type,
        components: &[ComponentType],
    ) -> Result<Vec<[f64; N]>> {
        let field = format!("accessors[{}]", index.value());
        let accessor = self.root.get(index).ok_or_else(|| self.error(&field, "an existing accessor", "none"))?;
        let Checked::Valid(GenericComponentType(component_type)) = accessor.component_type else {
            return Err(self.error(field, "a component type", "another"));
        };
        if accessor.type_ != Checked::Valid(kind) || !components.contains(&component_type) {
            let got = format!("{:?} of {component_type:?}", accessor.type_);
            return Err(self.error(field, format!("{kind:?} of {components:?}"), got));
        }
        let size = (component_type.size() * N) as u64;
        let stride = |view: Index<buffer::View>| {
            self.root.get(view).and_then(|view| view.byte_stride).map_or(size, |stride| stride.0 as u64)
        };
        let decode = |bytes: &[u8]| {
            let mut parts = bytes.chunks(component_type.size());
            [(); N].map(|()| parts.next().map_or(0.0, |part| component(part, component_type, accessor.normalized)))
        };
        let count = accessor.count.0;
        let mut values = match accessor.buffer_view {
            Some(view) => {
                let offset = accessor.byte_offset.unwrap_or_default().0;
                self.elements(&field, view, &Span { offset, stride: stride(view), size, count })?.map(decode).collect()
            }
            None => {
                // Zeros that no byte stands for.
                let most = self.buffers.iter().map(|b| b.len() as u64).sum::<u64>();
                if count > most {
                    return Err(self.error(field, format!("at most {most} elements without a view"), count));
                }
                vec![[0.0; N]; count as usize]
            }
        };
        if let Some(sparse) = &accessor.sparse {
            let field = format!("{field}.sparse");
            let Checked::Valid(IndexComponentType(index_type)) = sparse.indices.component_type else {
                return Err(self.error(field, "an index type", "another"));
            };
            let (size_of_index, count) = (index_type.size() as u64, sparse.count.0);
            let offset = sparse.indices.byte_offset.0;
            let places = Span { offset, stride: size_of_index, size: size_of_index, count };
            let places = self.elements(&field, sparse.indices.buffer_view, &places)?;
            let span = Span { offset: sparse.values.byte_offset.0, stride: size, size, count };
            let new = self.elements(&field, sparse.values.buffer_view, &span)?;
            for (place, new) in places.zip(new) {
                let place = component(place, index_type, false) as usize;
                let expected = format!("indices below {}", values.len());
                *values.get_mut(place).ok_or_else(|| self.error(&field, expected, place))? = decode(new);
            }
        }
        Ok(values)
    }
}
