//! What residuals do at each sample of the last frame, and the errors of fits that they go by.

use crate::config::Config;
use crate::offline::error::Result;
use crate::offline::levels;
use crate::offline::reference::MIN_COSINE;
use crate::offline::session::Session;
use glam::{DVec3, Vec3};

/// What is done about the light that a sample's lobes miss.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Decision {
    /// There is no surface.
    Background,
    /// Nothing: the fit misses too little and there are no area lights, or nothing is ever estimated.
    Nothing,
    /// It is up-sampled from coarser cells.
    UpSampled,
    /// It is estimated, for the coarsest cell that the sample stands for: of this level over a sample.
    Shaded(u32),
}

impl Decision {
    /// As a layer has it: -1, 0, 1, and 2 and more.
    pub fn code(self) -> f32 {
        match self {
            Self::Background => -1.0,
            Self::Nothing => 0.0,
            Self::UpSampled => 1.0,
            Self::Shaded(level) => 2.0 + level as f32,
        }
    }
}

/// For each sample, row by row, the error of its material's fit at its view angle: the share of light that is missed. It is 1, as
/// nothing is known, where no fit stands for the material, and 0 without a surface. `approximation_error` of
/// `glsl/include/approximation.glsl` is the same on the device.
///
/// # Errors
/// The device's, on read-back.
pub fn fit_errors(session: &mut Session) -> Result<Vec<f32>> {
    let (ids, _, [width, height]) = session.image("ids")?;
    let (normals, ..) = session.image("normals")?;
    let (ids, normals): (Vec<u32>, Vec<[f32; 4]>) = (bytemuck::pod_collect_to_vec(&ids), bytemuck::pod_collect_to_vec(&normals));
    let view = session.view();
    let (turn, ray) = (view.world_from_view(), view.ray());
    let cosine = |i: usize, [x, y, z, _]: [f32; 4]| {
        let at = |place: usize, extent: u32| (place as f32 + 0.5) / extent as f32 * 2.0 - 1.0;
        let (x_ndc, y_ndc) = (at(i % width as usize, width), at(i / width as usize, height));
        let toward = Vec3::new(x_ndc * ray.x + ray.z, y_ndc * ray.y + ray.w, -1.0);
        let toward = turn.transform_vector3(toward).as_dvec3().normalize();
        DVec3::new(x.into(), y.into(), z.into()).dot(-toward).max(MIN_COSINE)
    };
    let error = |(i, (id, normal)): (usize, (&u32, &[f32; 4]))| {
        let Some(material) = id.checked_sub(1).map(|id| id as usize & 0xffff) else { return 0.0 };
        let fit = session.fits().get(material).and_then(Option::as_ref);
        fit.map_or(1.0, |fit| fit.at(cosine(i, *normal)).error as f32)
    };
    Ok(ids.iter().zip(&normals).enumerate().map(error).collect())
}

/// For each sample, row by row, what its residual is.
///
/// # Errors
/// The device's, on read-back.
pub fn decisions(session: &mut Session, config: &Config) -> Result<Vec<Decision>> {
    let (ids, _, [width, _]) = session.image("ids")?;
    let seen = ids.chunks_exact(4).map(|id| id.iter().any(|byte| *byte != 0));
    if !config.estimator.has_residual() {
        return Ok(seen.map(|seen| if seen { Decision::Nothing } else { Decision::Background }).collect());
    }
    let mut all: Vec<_> = seen.map(|seen| if seen { Decision::UpSampled } else { Decision::Background }).collect();
    for ([x, y], level) in levels::shaded(session)? {
        let Some(found) = all.get_mut(y as usize * width as usize + x as usize) else { continue };
        *found = match *found {
            Decision::Shaded(known) => Decision::Shaded(known.max(level)),
            _ => Decision::Shaded(level),
        };
    }
    if config.residual_is_factor() && session.sources().1 == 0 {
        let negligible = config.residual_errors[0];
        for (found, error) in all.iter_mut().zip(fit_errors(session)?) {
            if *found != Decision::Background && error <= negligible {
                *found = Decision::Nothing;
            }
        }
    }
    Ok(all)
}
