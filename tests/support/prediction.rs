//! The `bandwidth` pass in f64, block by block, from a frame's own images.
#![allow(dead_code, reason = "each test file uses its part")]

#[path = "found.rs"]
mod found;

use found::Found;
use glam::{DMat3, DVec2, DVec3};
use passband::frequency::allocation::{DARK, Integrand};
use passband::frequency::operators::{Combine, Probe, Surface, nearby, pixel_angle};
use passband::frequency::{AngularBandwidth, TextureCells};
use passband::offline::session::Session;
use passband::offline::world::World;
use passband::reflectance::{ImportanceTable, LobeBandwidth, Model, Reflectance};
use passband::sampling::{luminance, sobol};
use passband::{Config, Light, Material, Sampling};

/// A light without extent varies faster than anything.
const SHARPEST: f64 = 1e6;

/// What the last frame saw and predicted.
pub struct Frame {
    /// Samples a side.
    pub extent: [usize; 2],
    pub ids: Vec<u32>,
    surface: Vec<[f64; 4]>,
    normals: Vec<[f64; 4]>,
    curvatures: Vec<[f64; 4]>,
    coordinates: Vec<[f64; 4]>,
    derivatives: Vec<[f64; 4]>,
    /// Layer after layer.
    lobes: Vec<[u32; 4]>,
    /// Blocks a side.
    pub blocks: [usize; 2],
    /// Bandwidth and spread of each block.
    pub prediction: Vec<[f64; 4]>,
    /// Of each sample.
    pub levels: Vec<u32>,
}

/// Four numbers a texel of an image of 16- or 32-bit floats, and its sides.
pub fn texels(session: &mut Session, name: &str) -> (Vec<[f64; 4]>, [usize; 2]) {
    let (bytes, format, extent) = session.image(name).unwrap();
    let numbers: Vec<f64> = if format == passband::ash::vk::Format::R16G16B16A16_SFLOAT {
        bytemuck::pod_collect_to_vec::<u8, half::f16>(&bytes).into_iter().map(f64::from).collect()
    } else {
        bytemuck::pod_collect_to_vec::<u8, f32>(&bytes).into_iter().map(f64::from).collect()
    };
    (numbers.chunks_exact(4).map(|c| [c[0], c[1], c[2], c[3]]).collect(), extent.map(|e| e as usize))
}

impl Frame {
    /// Needs [`Config::curvature`].
    pub fn read(session: &mut Session) -> Self {
        let (surface, extent) = texels(session, "surface");
        let (prediction, blocks) = texels(session, "prediction");
        let [normals, curvatures, coordinates, derivatives] =
            ["normals", "curvature", "coordinate", "derivative"].map(|name| texels(session, name).0);
        let [ids, levels] = ["ids", "level"].map(|name| bytemuck::pod_collect_to_vec(&session.image(name).unwrap().0));
        let lobes = bytemuck::pod_collect_to_vec(&session.image("lobes").unwrap().0);
        Self { lobes, extent, ids, surface, normals, curvatures, coordinates, derivatives, blocks, prediction, levels }
    }

    /// Samples of a block: their indices, and twice their offsets from its middle squared. At the border some stand twice.
    pub fn samples(&self, block: usize, side: usize) -> impl Iterator<Item = (usize, i64)> + '_ {
        let first = [block % self.blocks[0] * side, block / self.blocks[0] * side];
        (0..side * side).map(move |k| {
            let o = [k % side, k / side];
            let off: i64 = o.iter().map(|&o| (2 * o as i64 - side as i64 + 1).pow(2)).sum();
            let [x, y] = [0, 1].map(|a| (first[a] + o[a]).min(self.extent[a] - 1));
            (y * self.extent[0] + x, off)
        })
    }
}

/// What the twin finds in a block.
#[derive(Clone, Copy, Debug)]
pub struct Predicted {
    /// Cycles/sample.
    pub bandwidth: f64,
    /// The same if nothing cancelled: what rounding is a share of.
    pub terms: f64,
    /// The largest `terms` of any direction.
    pub greatest: f64,
    pub spread: f64,
    /// Logarithm of the weight by which directions are shared out.
    pub log_weight: f64,
    /// The sample that stood for the block.
    pub at: usize,
}

/// What is known of a world before any frame.
pub struct Twin<'a> {
    world: &'a World,
    materials: Vec<(Material, ImportanceTable, LobeBandwidth, Option<TextureCells>)>,
    environment: Option<AngularBandwidth>,
}

impl<'a> Twin<'a> {
    /// With the threshold of its frames.
    pub fn new(world: &'a World, eps: f64) -> Self {
        let material = |m: &passband::offline::world::Material| {
            // Colour maps count with their mean: what a pixel sees that spans the whole.
            let surface = m.surface();
            let mean = surface.at(DVec2::ZERO, [DVec2::splat(1e6); 2], Sampling::default()).reflectance(&m.model);
            let textures = surface.texture_bandwidth(eps);
            (surface, ImportanceTable::build(&mean), LobeBandwidth::build(&m.model, eps), textures)
        };
        let environment = world.environment.as_ref().map(|e| AngularBandwidth::of(&e.map, eps));
        Self { world, materials: world.materials.iter().map(material).collect(), environment }
    }

    /// `None` where nothing is covered.
    pub fn block(&self, frame: &Frame, config: &Config, block: usize, seed: u32) -> Option<Predicted> {
        let side = 2 * config.samples_per_side as usize;
        let covered = frame.samples(block, side).filter(|(p, _)| frame.ids[*p] != 0);
        let at = covered.min_by_key(|(_, off)| *off)?.0;
        let [width, height] = frame.extent.map(|e| e as f64);
        let camera = &self.world.camera;
        let tan = (camera.fov_y.to_radians() / 2.0).tan();
        let wide = tan * f64::from(config.extent[0]) / f64::from(config.extent[1]);
        let [column, row] = [at % frame.extent[0], at / frame.extent[0]].map(|p| p as f64 + 0.5);
        let plane = [(column / width * 2.0 - 1.0) * wide, (1.0 - row / height * 2.0) * tan];
        let ray = camera.world_from_view() * DVec3::new(plane[0], plane[1], -1.0);
        let depth = frame.surface[at][3];
        let (view, n) = (-ray.normalize(), DVec3::from_slice(&frame.normals[at][..3]));
        let local = frame_towards(n, view);
        let wo = local.transpose() * view;
        let point = camera.position + ray * depth;
        let [k1, k2, ..] = frame.curvatures[at];
        let surface = Surface {
            curvatures: [k1, k2],
            distance: depth * ray.length(),
            cosine: wo.z,
            pixel: pixel_angle(plane, [2.0 * wide / width, 2.0 * tan / height]),
        };
        let (material, table, lobes, textures) = &self.materials[(frame.ids[at] as usize - 1) & 0xffff];
        let [u, v, ..] = frame.coordinates[at];
        let [ux, vx, uy, vy] = frame.derivatives[at];
        let steps = [DVec2::new(ux, vx), DVec2::new(uy, vy)];
        let reflectance = material.at(DVec2::new(u, v), steps, Sampling::default()).reflectance(&material.model);

        // What the filter found, of GGX.
        let layers = if config.filter.lobe_layers() > 0 { frame.lobes.chunks_exact(frame.ids.len()) } else { [].chunks_exact(1) };
        let found = match material.model {
            Model::Ggx(ggx) => Found::unpack(layers.map(|layer| layer[at]), &local, ggx),
            _ => {
                assert!(config.filter.lobe_layers() == 0, "no twin for the lobes of this material");
                None
            }
        };
        let evaluate = |wi| found.as_ref().map_or_else(|| reflectance.evaluate(wi, wo), |f| f.evaluate(wi, wo));
        let lobe_at = |wi| found.as_ref().map_or_else(|| lobes.at(wi, wo), |f| f.bandwidth(wi, wo));

        let mut all = Directions { config, surface, found: Vec::new() };
        let blocks = ((block / frame.blocks[0]) << 16) | (block % frame.blocks[0]);
        let mut estimates = Vec::new();
        let mut integrands = Vec::new();
        for i in 0..config.probes {
            let point = sobol::point(i, sobol::hash(blocks as u32) ^ seed).map(sobol::to_unit);
            let drawn = match &found {
                Some(found) => found.sample(wo, point).map(|wi| (wi, 1.0 / found.density(wi, wo))),
                None => {
                    let (h, density) = table.half_vector(wo.z, point);
                    let cosine = wo.dot(h);
                    (cosine > 0.0).then(|| (2.0 * cosine * h - wo, 4.0 * cosine / density))
                }
            };
            let (Some(light), Some(bandwidth)) = (&self.world.environment, &self.environment) else { continue };
            let Some((wi, per_density)) = drawn.filter(|(wi, _)| wi.z > 0.0) else {
                estimates.push(0.0);
                integrands.push(Integrand::default());
                continue;
            };
            let towards = local * wi;
            let radiance = luminance(light.radiance(towards));
            let reflected = luminance(evaluate(wi)) * wi.z;
            let turned = DMat3::from_rotation_y(-light.rotation.to_radians()) * towards;
            all.add(bandwidth.towards(turned), lobe_at(wi), 0.0, [radiance, reflected, per_density]);
            let estimate = radiance * reflected * per_density;
            estimates.push(estimate);
            let angular = bandwidth.towards(turned) + lobe_at(wi);
            integrands.push(Integrand { bandwidth: angular, product: radiance * reflected / wi.z, estimate });
        }
        let mut by_lights = 0.0;
        for light in &self.world.lights {
            let (towards, distance, radiance) = arrives(light, point);
            let wi = local.transpose() * towards;
            if wi.z > 0.0 {
                let reflected = luminance(evaluate(wi)) * wi.z;
                let near = nearby(distance, wi.z);
                by_lights += radiance * reflected;
                all.add(SHARPEST, lobe_at(wi), near, [radiance, reflected, f64::from(config.probes)]);
            }
        }
        let longest = steps.iter().map(|d| d.length()).fold(0.0, f64::max);
        let tiling = DVec2::from(material.maps.tiling.map(f64::from));
        let place = DVec2::new(u, v) * tiling;
        let cycles = textures.as_ref().map_or(0.0, |cells| cells.at(place, longest * tiling.max_element()));
        let texture = (cycles * longest).min(0.5);
        let mean = estimates.iter().sum::<f64>() / f64::from(config.probes);
        let squares = estimates.iter().map(|e| e * e).sum::<f64>() / f64::from(config.probes);
        let spread = if mean > 0.0 { (squares - mean * mean).max(0.0).sqrt() / mean } else { 0.0 };
        let [bandwidth, terms] = [0, 1].map(|k| all.combined(k) + texture);
        let greatest = all.found.iter().map(|(b, ..)| b[1]).fold(0.0, f64::max) + texture;
        let map = self.world.environment.as_ref();
        let dark = DARK * map.map_or(0.0, |light| light.intensity * light.map.mean_luminance());
        let log_weight = config.allocation.log_weight(&integrands, by_lights, dark);
        Some(Predicted { bandwidth, terms, greatest, spread, log_weight, at })
    }
}

/// Bandwidth of a direction and what it would be if nothing cancelled; radiance, reflectance times cosine, one over density.
struct Directions<'a> {
    config: &'a Config,
    surface: Surface,
    found: Vec<([f64; 2], [f64; 3])>,
}

impl Directions<'_> {
    fn add(&mut self, light: f64, lobe: f64, near: f64, weight: [f64; 3]) {
        let own = self.surface.curvatures.map(|k| k + near);
        let bandwidth = [own, own.map(f64::abs)].map(|curvatures| {
            let surface = Surface { curvatures, ..self.surface };
            self.config.operator.image(light, lobe, &surface)
        });
        self.found.push((bandwidth, weight));
    }

    fn combined(&self, kind: usize) -> f64 {
        let probe = |(bandwidth, [radiance, reflected, per_density]): &([f64; 2], [f64; 3])| Probe {
            bandwidth: bandwidth[kind],
            radiance: *radiance,
            reflected: reflected * if self.config.combine == Combine::Literal { 1.0 } else { *per_density },
        };
        self.config.combine.over(&self.found.iter().map(probe).collect::<Vec<_>>())
    }
}

/// Columns x, y, z of the frame in which reflectances are evaluated, bent towards the viewer where it faces away.
fn frame_towards(n: DVec3, view: DVec3) -> DMat3 {
    let cosine = n.dot(view);
    let n = if cosine < 0.02 { view * 0.02 + (n - view * cosine).normalize() * (1.0f64 - 0.02 * 0.02).sqrt() } else { n };
    let x = (view - n * n.dot(view)).normalize();
    DMat3::from_cols(x, n.cross(x), n)
}

/// Direction towards a light, its distance, and the radiance times solid angle that its middle brings.
fn arrives(light: &Light, point: DVec3) -> (DVec3, f64, f64) {
    let vector = |v: [f32; 3]| DVec3::from(v.map(f64::from));
    let to = |position: [f32; 3]| vector(position) - point;
    match *light {
        Light::Point { position, intensity } => {
            let d = to(position);
            (d.normalize(), d.length(), luminance(vector(intensity)) / d.length_squared())
        }
        Light::Directional { direction, irradiance } => {
            (-vector(direction).normalize(), f64::INFINITY, luminance(vector(irradiance)))
        }
        Light::Sphere { position, radius, radiance } => {
            let d = to(position);
            let cap = 1.0 - (1.0 - (f64::from(radius) / d.length()).powi(2)).sqrt();
            (d.normalize(), d.length(), luminance(vector(radiance)) * std::f64::consts::TAU * cap)
        }
        Light::Rectangle { .. } => unreachable!("no test has one"),
    }
}
