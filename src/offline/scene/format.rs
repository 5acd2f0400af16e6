//! The keys of a scene file, as serde reads them: every key that the format knows, with its type. What the values may
//! be is checked in [`super::check`].
//!
//! Beside the format's own wording: `rotate` turns about X, then Y, then Z; translation comes last and scaling first.
//! Colours and scales may be one number for all three. An object whose mesh is a glTF file may leave out
//! `material`: it then has the file's own; and `[camera]` may be left out if such a file has one.
//!
//! Keyframes carry their `frame`; animated objects are `[[animation.objects]]` with `object = INDEX` and `keyframes = [...]`.
//! What a key gives takes the place of the camera's or object's own, linearly between keys, rotations by the shortest arc; what
//! no key gives stays. `wave` is in metres of the mesh, before its object's transform, `speed` in metres a frame; it travels
//! along `direction` ([1, 0, 0]) over `objects = [INDEX, ...]` (all).

use serde::de::{Error as _, IgnoredAny, SeqAccess};
use serde::{Deserialize, Deserializer};
use std::collections::BTreeMap;
use toml::Spanned;

pub(super) type Key<T> = Option<Spanned<T>>;
pub(super) type Vector = [f64; 3];

/// An array of `N` and no more.
fn exactly<'de, D: Deserializer<'de>, T: Deserialize<'de>, const N: usize>(deserializer: D) -> Result<Spanned<[T; N]>, D::Error> {
    let all = Spanned::<Vec<T>>::deserialize(deserializer)?;
    let (span, all) = (all.span(), all.into_inner());
    let array = all.try_into().map_err(|all: Vec<T>| D::Error::invalid_length(all.len(), &format!("{N} numbers").as_str()))?;
    Ok(Spanned::new(span, array))
}

fn some_exactly<'de, D: Deserializer<'de>, T: Deserialize<'de>, const N: usize>(
    deserializer: D,
) -> Result<Key<[T; N]>, D::Error> {
    exactly(deserializer).map(Some)
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SceneFile {
    pub camera: Option<Camera>,
    pub environment: Key<Environment>,
    #[serde(default)]
    pub lights: Vec<Spanned<Light>>,
    pub objects: Spanned<Vec<Spanned<Object>>>,
    #[serde(default)]
    pub materials: BTreeMap<String, Spanned<Material>>,
    pub animation: Key<Animation>,
    #[serde(default)]
    pub settings: Settings,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Camera {
    #[serde(deserialize_with = "exactly")]
    pub position: Spanned<Vector>,
    #[serde(default, deserialize_with = "some_exactly")]
    pub target: Key<Vector>,
    #[serde(default, deserialize_with = "some_exactly")]
    pub up: Key<Vector>,
    pub fov_y: Key<f64>,
    #[serde(default, deserialize_with = "some_exactly")]
    pub size: Key<[u32; 2]>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Environment {
    pub map: Key<String>,
    pub builtin: Key<String>,
    pub intensity: Key<f64>,
    pub rotation: Key<f64>,
    #[serde(default)]
    pub visible: bool,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Light {
    pub r#type: Spanned<String>,
    #[serde(default, deserialize_with = "some_exactly")]
    pub position: Key<Vector>,
    #[serde(default, deserialize_with = "some_exactly")]
    pub direction: Key<Vector>,
    #[serde(default, deserialize_with = "some_exactly")]
    pub u: Key<Vector>,
    #[serde(default, deserialize_with = "some_exactly")]
    pub v: Key<Vector>,
    pub radius: Key<f64>,
    pub intensity: Key<Triple>,
    pub irradiance: Key<Triple>,
    pub radiance: Key<Triple>,
    /// A file with its mask.
    pub shadow: Key<String>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Object {
    pub mesh: Key<String>,
    pub builtin: Key<String>,
    pub detail: Key<u32>,
    pub material: Key<String>,
    pub uv: Key<String>,
    #[serde(default, deserialize_with = "some_exactly")]
    pub translate: Key<Vector>,
    #[serde(default, deserialize_with = "some_exactly")]
    pub rotate: Key<Vector>,
    pub scale: Key<Triple>,
    #[serde(default, deserialize_with = "some_exactly")]
    pub transform: Key<[f64; 16]>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Material {
    pub reflectance: Spanned<Reflectance>,
    pub albedo_map: Key<String>,
    pub specular_map: Key<String>,
    pub normal_map: Key<String>,
    pub height_map: Key<String>,
    pub height_scale: Key<f64>,
    pub displace: Key<bool>,
    pub roughness_map: Key<String>,
    pub roughness: Key<String>,
    #[serde(default, deserialize_with = "some_exactly")]
    pub tiling: Key<[f64; 2]>,
    pub normal_encoding: Key<String>,
    pub normal_y: Key<String>,
}

/// The keys of [`Reflectance`], of which a material has one.
pub(super) const REFLECTANCES: &[&str] = &["merl", "sgd", "rgl", "ggx", "blinn_phong", "vmf", "builtin"];

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Reflectance {
    pub merl: Key<String>,
    pub sgd: Key<Sgd>,
    pub rgl: Key<String>,
    pub ggx: Key<Ggx>,
    pub blinn_phong: Key<BlinnPhong>,
    pub vmf: Key<Vec<Vmf>>,
    pub builtin: Key<String>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Sgd {
    pub table: Key<String>,
    pub name: Key<String>,
    pub rhod: Key<Triple>,
    pub rhos: Key<Triple>,
    pub alpha: Key<Triple>,
    pub p: Key<Triple>,
    #[serde(rename = "F0")]
    pub f0: Key<Triple>,
    #[serde(rename = "F1")]
    pub f1: Key<Triple>,
    pub kap: Key<Triple>,
    pub lambda: Key<Triple>,
    pub c: Key<Triple>,
    pub k: Key<Triple>,
    pub theta0: Key<Triple>,
}

impl Sgd {
    /// The inline parameters in the order of [`crate::reflectance::sgd::PARAMETERS`].
    pub fn parameters(&self) -> [&Key<Triple>; 11] {
        [
            &self.rhod,
            &self.rhos,
            &self.alpha,
            &self.p,
            &self.f0,
            &self.f1,
            &self.kap,
            &self.lambda,
            &self.c,
            &self.k,
            &self.theta0,
        ]
    }
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Ggx {
    pub alpha: Spanned<f64>,
    pub f0: Spanned<Triple>,
    pub albedo: Spanned<Triple>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct BlinnPhong {
    pub exponent: Spanned<f64>,
    pub specular: Spanned<Triple>,
    pub albedo: Spanned<Triple>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Vmf {
    #[serde(deserialize_with = "exactly")]
    pub mu: Spanned<Vector>,
    pub kappa: Spanned<f64>,
    pub weight: Spanned<f64>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Animation {
    pub frames: Spanned<u32>,
    #[serde(default)]
    pub camera: Vec<CameraKey>,
    #[serde(default)]
    pub objects: Vec<AnimatedObject>,
    pub wave: Option<Wave>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct CameraKey {
    pub frame: Spanned<u32>,
    #[serde(default, deserialize_with = "some_exactly")]
    pub position: Key<Vector>,
    #[serde(default, deserialize_with = "some_exactly")]
    pub target: Key<Vector>,
    #[serde(default, deserialize_with = "some_exactly")]
    pub up: Key<Vector>,
    pub fov_y: Key<f64>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct AnimatedObject {
    pub object: Spanned<u32>,
    pub keyframes: Vec<ObjectKey>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ObjectKey {
    pub frame: Spanned<u32>,
    #[serde(default, deserialize_with = "some_exactly")]
    pub translate: Key<Vector>,
    #[serde(default, deserialize_with = "some_exactly")]
    pub rotate: Key<Vector>,
    pub scale: Key<Triple>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Wave {
    pub amplitude: Spanned<f64>,
    pub length: Spanned<f64>,
    pub speed: Spanned<f64>,
    #[serde(default, deserialize_with = "some_exactly")]
    pub direction: Key<Vector>,
    pub objects: Option<Vec<Spanned<u32>>>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Settings {
    pub operator: Key<String>,
    pub combine: Key<String>,
    pub eps: Key<f64>,
    pub lobe_components: Key<u32>,
    pub np_rule: Key<String>,
    pub budget: Key<u32>,
    pub lmax: Key<u32>,
    pub bins: Key<String>,
    pub eps0: Key<f64>,
    pub eps1: Key<f64>,
    pub anisotropy: Key<f64>,
    pub lod_bias: Key<f64>,
    pub geometric: Key<bool>,
    pub reflectance_share: Key<f64>,
    pub fit_lobes: Key<u32>,
    pub fit_error: Key<f64>,
    #[serde(default, deserialize_with = "some_exactly")]
    pub residual_errors: Key<Vector>,
    pub exact_lobes: Key<bool>,
}

/// Three numbers, or one for all three.
#[derive(Clone, Copy, Debug)]
pub(super) struct Triple(pub Vector);

impl<'de> Deserialize<'de> for Triple {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Visitor;
        impl<'de> serde::de::Visitor<'de> for Visitor {
            type Value = Triple;

            fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                f.write_str("a number or three numbers")
            }

            fn visit_f64<E>(self, v: f64) -> Result<Triple, E> {
                Ok(Triple([v; 3]))
            }

            fn visit_i64<E>(self, v: i64) -> Result<Triple, E> {
                Ok(Triple([v as f64; 3]))
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Triple, A::Error> {
                let vector = Vector::deserialize(serde::de::value::SeqAccessDeserializer::new(&mut seq))?;
                // What is left over would not be missed.
                if seq.next_element::<IgnoredAny>()?.is_some() {
                    return Err(A::Error::invalid_length(4, &self));
                }
                Ok(Triple(vector))
            }
        }
        deserializer.deserialize_any(Visitor)
    }
}
