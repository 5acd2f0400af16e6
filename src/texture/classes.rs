//! Which array of layers holds each texture: one array a size and format, few enough for a fixed set of bindings.

use crate::material::Material;
use crate::texture::{Format, Texture, halved};
use std::sync::Arc;

/// Arrays that one set of materials may have.
pub const MAX_CLASSES: usize = 8;

/// Textures of one size and format: the layers of one array.
#[derive(Clone, Debug)]
pub struct Class {
    /// Width and height of level 0, in texels.
    pub size: [u32; 2],
    /// How texels are stored.
    pub format: Format,
    /// Each of this size and format.
    pub layers: Vec<Arc<Texture>>,
}

/// Class and layer of each map of a material.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Slots {
    /// Of the albedo map.
    pub albedo: Option<(usize, usize)>,
    /// Of the specular map.
    pub specular: Option<(usize, usize)>,
    /// Of the normal map.
    pub normal: Option<(usize, usize)>,
    /// Of the roughness map.
    pub roughness: Option<(usize, usize)>,
}

/// The arrays of a set of materials.
#[derive(Clone, Debug, Default)]
pub struct Classes {
    /// At most [`MAX_CLASSES`], in the order of first use.
    pub classes: Vec<Class>,
    /// One a material, in order.
    pub slots: Vec<Slots>,
}

impl Classes {
    /// Sorts the maps of `materials` into arrays. A texture that several maps share is there once. Of more than
    /// [`MAX_CLASSES`] sizes and formats, those whose union costs the fewest bytes become one: the smaller are resampled to
    /// the larger size, bilinear, in linear light.
    pub fn of(materials: &[Material]) -> Self {
        Self::within(materials, MAX_CLASSES)
    }

    /// The same with at most `most` arrays, which are no fewer than there are formats.
    pub(crate) fn within(materials: &[Material], most: usize) -> Self {
        let mut textures: Vec<Arc<Texture>> = Vec::new();
        for material in materials {
            for texture in material.maps.textures().into_iter().flatten() {
                if !textures.iter().any(|known| Arc::ptr_eq(known, texture)) {
                    textures.push(Arc::clone(texture));
                }
            }
        }
        let groups = groups(&textures, most);
        let mut classes: Vec<Class> = Vec::with_capacity(groups.len());
        let mut places = vec![(0, 0); textures.len()];
        for (number, group) in groups.into_iter().enumerate() {
            let mut layers = Vec::with_capacity(group.members.len());
            for member in group.members {
                places[member] = (number, layers.len());
                let texture = &textures[member];
                let fits = texture.size() == group.size;
                layers.push(if fits { Arc::clone(texture) } else { Arc::new(texture.resampled(group.size)) });
            }
            classes.push(Class { size: group.size, format: group.format, layers });
        }
        let place = |texture: Option<&Arc<Texture>>| {
            let known = textures.iter().position(|known| texture.is_some_and(|t| Arc::ptr_eq(known, t)));
            known.map(|known| places[known])
        };
        let slots = |material: &Material| {
            let [albedo, specular, normal, roughness] = material.maps.textures().map(place);
            Slots { albedo, specular, normal, roughness }
        };
        Self { classes, slots: materials.iter().map(slots).collect() }
    }
}

/// Textures, by their number, that become one class.
struct Group {
    size: [u32; 2],
    format: Format,
    members: Vec<usize>,
}

impl Group {
    fn bytes(&self) -> u64 {
        self.members.len() as u64 * bytes(self.format, self.size)
    }

    /// The size that holds both, and the bytes that it takes beyond theirs.
    fn union(&self, other: &Self) -> ([u32; 2], u64) {
        let size = [self.size[0].max(other.size[0]), self.size[1].max(other.size[1])];
        let all = (self.members.len() + other.members.len()) as u64 * bytes(self.format, size);
        (size, all - self.bytes() - other.bytes())
    }
}

/// Bytes of a texture with its mips.
fn bytes(format: Format, mut size: [u32; 2]) -> u64 {
    let mut texels = 0;
    loop {
        texels += u64::from(size[0]) * u64::from(size[1]);
        if size == [1, 1] {
            return texels * format.bytes() as u64;
        }
        size = halved(size);
    }
}

/// At most `most` groups: there are no more formats than that.
fn groups(textures: &[Arc<Texture>], most: usize) -> Vec<Group> {
    let mut groups: Vec<Group> = Vec::new();
    for (number, texture) in textures.iter().enumerate() {
        let (size, format) = (texture.size(), texture.format());
        match groups.iter_mut().find(|g| g.size == size && g.format == format) {
            Some(group) => group.members.push(number),
            None => groups.push(Group { size, format, members: vec![number] }),
        }
    }
    while groups.len() > most {
        let pairs = (0..groups.len()).flat_map(|b| (0..b).map(move |a| (a, b)));
        let alike = pairs.filter(|&(a, b)| groups[a].format == groups[b].format);
        let Some((a, b)) = alike.min_by_key(|&(a, b)| groups[a].union(&groups[b]).1) else { break };
        let merged = groups.remove(b);
        groups[a].size = groups[a].union(&merged).0;
        groups[a].members.extend(merged.members);
        // The union may be as large as another.
        let (size, format) = (groups[a].size, groups[a].format);
        if let Some(same) = (0..groups.len()).find(|&c| c != a && groups[c].size == size && groups[c].format == format) {
            let merged = groups.remove(a.max(same));
            groups[a.min(same)].members.extend(merged.members);
        }
    }
    groups
}
