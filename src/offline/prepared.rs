//! What of materials takes seconds, before they go to the device: from the user's cache where it is known.

use crate::distribution::alignment::Order;
use crate::offline::progress::Progress;
use crate::offline::world::World;
use crate::offline::{fit_cache, gaussians_cache, lobe_cache};
use crate::{Config, Material};
use std::sync::Arc;
use std::time::Instant;

/// The materials of a world with all that a renderer would otherwise find anew.
pub(super) struct Prepared {
    pub materials: Vec<Material>,
    /// What mixtures took, where they are not the device's.
    pub mixtures_ms: Option<f64>,
}

impl Prepared {
    /// For frames of `config`. `told` is told how many of how many materials are analysed and fitted.
    pub fn new(world: &World, config: &Config, told: &mut Progress<'_>) -> Self {
        let mut materials: Vec<_> = world.materials.iter().map(|m| m.surface()).collect();
        if config.predicts() {
            let folder = lobe_cache::cache_folder();
            each_told("bandwidth of lobes", materials.iter_mut(), told, |m: &mut Material| {
                m.lobe_bandwidth = Some(Arc::new(lobe_cache::lobe_bandwidth(&m.model, config.eps, folder.as_deref())));
            });
        }
        if config.estimator.looks_up() {
            let folder = fit_cache::cache_folder();
            each_told("lobe fits", materials.iter_mut().filter(|m| m.keeps_model()), told, |m: &mut Material| {
                m.lobe_fit = Some(Arc::new(fit_cache::lobe_fit(&m.model, config.fit_budget(), folder.as_deref())));
            });
        }
        // Those of a level at a time are the device's.
        let on_host = config.filter.gaussians().is_some_and(|fit| fit.order != Order::Levels);
        let clock = Instant::now();
        if on_host {
            let folder = gaussians_cache::cache_folder();
            each_told("mixtures", materials.iter_mut(), told, |m: &mut Material| {
                m.gaussians = gaussians_cache::gaussians(m, config.filter, folder.as_deref());
            });
        }
        Self { materials, mixtures_ms: on_host.then(|| clock.elapsed().as_secs_f64() * 1e3) }
    }
}

/// Does something with each of `all` and tells of it.
fn each_told<T>(what: &str, all: impl Iterator<Item = T>, told: &mut Progress<'_>, mut work: impl FnMut(T)) {
    let all: Vec<T> = all.collect();
    let total = all.len() as u64;
    for (done, one) in (0..).zip(all) {
        told(what, done, total);
        work(one);
    }
}
