//! The instant BRDF map (Xu et al. 2017, section 4): the lobes of every texel, from which mips are made. Texture space only: the
//! lobes stay in the tangent frame, so that the map does not depend on geometry or camera.

use crate::distribution::effective::{self, Rule};
use crate::distribution::vmf::{self, Lobe};
use crate::error::{Error, Result};
use crate::material::{Material, unit};
use crate::texture::{MAX_SIDE, Texture, for_each_cover};
use glam::{DVec2, DVec3};

/// Lobes whose direction has more than this for a cosine are about the normal.
pub(crate) const UPRIGHT: f64 = 1.0 - 1e-6;

/// Lobes of the texels of a map, the same number in each, of weights that sum to 1 in each.
#[derive(Clone, Debug)]
pub struct BrdfMap {
    size: [u32; 2],
    lobes_per_texel: usize,
    lobes: Vec<Lobe>,
    /// Of each texel, if its lobes are about other directions.
    normals: Vec<DVec3>,
    /// Factors on the specular colour of each texel, if these are known.
    colours: Vec<DVec3>,
}

impl BrdfMap {
    /// A map of given lobes, texel by texel, row by row.
    ///
    /// # Errors
    /// [`Error::InvalidInput`] for a side of 0 or above [`MAX_SIDE`], another number of lobes, a mean direction that is not of
    /// length 1, a concentration or weight that is negative or not finite, or weights of a texel that do not sum to 1 within
    /// 1e-6.
    pub fn new(size: [u32; 2], lobes_per_texel: usize, lobes: Vec<Lobe>) -> Result<Self> {
        check_size(size)?;
        let expected = size[0] as usize * size[1] as usize * lobes_per_texel;
        if lobes_per_texel == 0 || lobes.len() != expected {
            return Err(Error::invalid("brdf map", format!("{expected} lobes, at least one a texel"), lobes.len()));
        }
        for (i, lobe) in lobes.iter().enumerate() {
            let of = |part: &str| format!("brdf map.lobes[{i}].{part}");
            if (lobe.mu.length_squared() - 1.0).abs() > 1e-6 || !lobe.mu.is_finite() {
                return Err(Error::invalid(of("mu"), "a vector of length 1", lobe.mu));
            }
            for (part, value) in [("kappa", lobe.kappa), ("weight", lobe.weight)] {
                if !(value >= 0.0 && value.is_finite()) {
                    return Err(Error::invalid(of(part), "a finite number >= 0", value));
                }
            }
        }
        for (i, texel) in lobes.chunks(lobes_per_texel).enumerate() {
            let sum: f64 = texel.iter().map(|l| l.weight).sum();
            if (sum - 1.0).abs() > 1e-6 {
                return Err(Error::invalid(format!("brdf map.texel {i}"), "weights of sum 1", sum));
            }
        }
        Ok(Self { size, lobes_per_texel, lobes, normals: Vec::new(), colours: Vec::new() })
    }

    /// The map of a material: at each texel its base lobes under the normals and the roughness that its maps have there. Where
    /// those are finer, both are averaged over the texel, normals and the lobes' mean vectors each on their own.
    ///
    /// # Errors
    /// [`Error::InvalidInput`] for a size as in [`Self::new`], and for tables, which have no lobes.
    pub fn of(material: &Material, size: [u32; 2], rule: Rule) -> Result<Self> {
        check_size(size)?;
        let base = |roughness| {
            effective::base(&material.model, roughness, rule)
                .ok_or_else(|| Error::invalid("material.model", "GGX, Blinn-Phong or vMF lobes", "a table"))
        };
        let plain = base(None)?;
        let count = size[0] as usize * size[1] as usize;
        let mut normals = vec![DVec3::Z; count];
        if let Some(map) = &material.maps.normal {
            let all = texels(map, |xyz| unit(xyz.truncate()));
            for_each_cover(map.size(), size, |i, covered| {
                normals[i] = covered.iter().map(|(from, share)| all[*from] * *share).sum();
            });
        }
        let mut bases = vec![];
        if let Some((map, kind)) = &material.maps.roughness {
            let all = texels(map, |value| material.model.roughness_from(*kind, value.x));
            let all = all.into_iter().map(|roughness| base(Some(roughness))).collect::<Result<Vec<_>>>()?;
            for_each_cover(map.size(), size, |_, covered| {
                bases.extend(plain.iter().enumerate().map(|(k, lobe)| {
                    let spread = covered.iter().map(|(from, share)| share * vmf::spread(all[*from][k].kappa)).sum();
                    Lobe { kappa: vmf::concentration(spread), ..*lobe }
                }));
            });
        }
        let of_texel = |i: usize| bases.get(i * plain.len()..(i + 1) * plain.len()).unwrap_or(&plain);
        let lobes = (0..count).flat_map(|i| effective::lobes(of_texel(i), normals[i], rule)).collect();
        let normals = if plain.iter().all(|l| l.mu.z > UPRIGHT) { Vec::new() } else { normals };
        let normals = normals.into_iter().map(|n| n.try_normalize().unwrap_or(DVec3::Z)).collect();
        Ok(Self { size, lobes_per_texel: plain.len(), lobes, normals, colours: Vec::new() })
    }

    /// The same with the mean of a map of specular colours over each texel.
    pub(crate) fn coloured(mut self, map: &Texture) -> Self {
        let all = texels(map, |colour| colour);
        for_each_cover(map.size(), self.size, |_, covered| {
            self.colours.push(covered.iter().map(|(from, share)| all[*from] * *share).sum());
        });
        self
    }

    /// Width and height in texels.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// The same number in every texel.
    pub fn lobes_per_texel(&self) -> usize {
        self.lobes_per_texel
    }

    /// All lobes, texel by texel, row by row.
    pub fn lobes(&self) -> &[Lobe] {
        &self.lobes
    }

    /// The mean normal of texel `i`, where its lobes are about other directions.
    pub fn normal(&self, i: usize) -> Option<DVec3> {
        self.normals.get(i).copied()
    }

    /// The factor on the specular colour of texel `i`, if it is known.
    pub(crate) fn colour(&self, i: usize) -> Option<DVec3> {
        self.colours.get(i).copied()
    }

    /// The lobes of texel `i`; none beyond the last.
    pub fn texel(&self, i: usize) -> &[Lobe] {
        self.lobes.get(i * self.lobes_per_texel..(i + 1) * self.lobes_per_texel).unwrap_or_default()
    }
}

fn check_size(size: [u32; 2]) -> Result<()> {
    let right = size.iter().all(|side| (1..=MAX_SIDE).contains(side));
    let expected = || format!("1x1 to {MAX_SIDE}x{MAX_SIDE}");
    if right { Ok(()) } else { Err(Error::invalid("brdf map size", expected(), format!("{}x{}", size[0], size[1]))) }
}

/// What `of` makes of the first three components of each texel.
fn texels<T>(map: &Texture, of: impl Fn(DVec3) -> T) -> Vec<T> {
    let [w, h] = map.size();
    let at = |x: u32, y: u32| DVec2::new((f64::from(x) + 0.5) / f64::from(w), 1.0 - (f64::from(y) + 0.5) / f64::from(h));
    (0..h).flat_map(|y| (0..w).map(move |x| [x, y])).map(|[x, y]| of(map.sample(at(x, y), 0.0).truncate())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::{Maps, Roughness};
    use crate::reflectance::{Ggx, MerlTable, Model};
    use std::sync::Arc;

    fn material() -> Material {
        let normal = |i: i32| DVec3::new(0.5 - f64::from(i % 2), 0.25, 0.8).normalize().as_vec3().to_array();
        let normals = Texture::normals([4, 2], &(0..8).map(normal).collect::<Vec<_>>()).unwrap();
        let roughness = Texture::scalar([2, 1], &[0.25, 0.5]).unwrap();
        let maps =
            Maps { normal: Some(Arc::new(normals)), roughness: Some((Arc::new(roughness), Roughness::Alpha)), ..Maps::default() };
        Material::new(Model::Ggx(Ggx { alpha: 0.9, f0: DVec3::ONE, albedo: DVec3::ZERO }), maps)
    }

    #[test]
    fn each_texel_has_what_the_maps_say() {
        let map = BrdfMap::of(&material(), [4, 2], Rule::Exact).unwrap();
        for i in 0..8 {
            let [lobe] = map.texel(i) else { panic!("one lobe") };
            let x = if i % 2 == 0 { 0.5 } else { -0.5 };
            // Half floats.
            assert!((lobe.mu - DVec3::new(x, 0.25, 0.8).normalize()).length() < 1e-3, "{i}: {lobe:?}");
            assert!((lobe.kappa / if i % 4 < 2 { 32.0 } else { 8.0 } - 1.0).abs() < 1e-7);
        }
        assert!(map.texel(8).is_empty());
    }

    #[test]
    fn coarser_texels_have_the_spread_of_their_normals() {
        let map = BrdfMap::of(&material(), [1, 1], Rule::Exact).unwrap();
        let lobe = map.texel(0)[0];
        let normal = DVec3::new(0.0, 0.25, 0.8) / DVec3::new(0.5, 0.25, 0.8).length();
        let base = 0.5 * (vmf::mean_cosine(32.0) + vmf::mean_cosine(8.0));
        assert!((lobe.mean() - normal * base).length() < 1e-3, "{lobe:?}");
        let finer = BrdfMap::of(&material(), [8, 6], Rule::Exact).unwrap();
        assert_eq!(finer.lobes().len(), 48);
        assert!((finer.texel(0)[0].kappa / 32.0 - 1.0).abs() < 1e-7);
    }

    #[test]
    fn what_is_no_map_is_refused() {
        let lobe = Lobe { mu: DVec3::Z, kappa: 1.0, weight: 1.0 };
        assert!(BrdfMap::new([2, 1], 1, vec![lobe; 2]).is_ok());
        for (size, count) in [([0, 1], 0), ([1, 1], 2), ([MAX_SIDE + 1, 1], 1)] {
            assert!(BrdfMap::new(size, 1, vec![lobe; count]).is_err());
        }
        let wrong = [
            Lobe { mu: DVec3::ONE, ..lobe },
            Lobe { mu: DVec3::splat(f64::NAN), ..lobe },
            Lobe { kappa: -1.0, ..lobe },
            Lobe { kappa: f64::INFINITY, ..lobe },
            Lobe { weight: 0.5, ..lobe },
        ];
        for lobe in wrong {
            let error = BrdfMap::new([1, 1], 1, vec![lobe]).unwrap_err().to_string();
            assert!(error.contains("brdf map") && error.contains("expected"), "{error}");
        }
        let table = Model::Table(Arc::new(MerlTable::from_fn(|_, _, _| DVec3::ONE)));
        assert!(BrdfMap::of(&Material::from(table), [4, 4], Rule::Exact).is_err());
        assert!(BrdfMap::of(&material(), [4, 0], Rule::Exact).is_err());
    }
}
