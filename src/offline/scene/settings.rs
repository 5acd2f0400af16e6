//! Rules for `[settings]`.

use crate::offline::error::Result;
use crate::offline::scene::check::Check;
use crate::offline::scene::format::Settings;

impl Check<'_> {
    pub(super) fn settings(&mut self, s: &Settings) -> Result<()> {
        self.each(&s.operator, |c, v| c.name(v, &["box", "clipped", "covariance"]))?;
        self.each(&s.combine, |c, v| c.name(v, &["mean", "max"]))?;
        self.each(&s.np_rule, |c, v| c.name(v, &["constant", "eq8", "sqrt", "relstd"]))?;
        self.each(&s.bins, |c, v| c.name(v, &["camera", "tangent"]))?;
        self.each(&s.eps, |c, v| c.number(v, "0.001 to 0.1", |v| (1e-3..=0.1).contains(&v)))?;
        self.each(&s.lobe_components, |c, v| {
            c.require(*v.get_ref() <= 16, &v.span(), "a whole number from 0 to 16", v.get_ref())
        })?;
        for threshold in [&s.eps0, &s.eps1] {
            self.each(threshold, |c, v| c.number(v, "0 < threshold < 1", |v| v > 0.0 && v < 1.0))?;
        }
        let directions = "a whole number from 1 to 65536";
        self.each(&s.budget, |c, v| c.require((1..=65536).contains(v.get_ref()), &v.span(), directions, v.get_ref()))?;
        self.each(&s.lmax, |c, v| c.require(*v.get_ref() <= 5, &v.span(), "a level from 0 to 5", v.get_ref()))?;
        self.each(&s.anisotropy, |c, v| c.number(v, "1 to 16", |v| (1.0..=16.0).contains(&v)))?;
        self.each(&s.lod_bias, |c, v| c.number(v, "-16 to 16", |v| v.abs() <= 16.0))?;
        self.each(&s.reflectance_share, |c, v| c.number(v, "0 < share < 1", |v| v > 0.0 && v < 1.0))?;
        self.each(&s.fit_lobes, |c, v| {
            c.require((1..=24).contains(v.get_ref()), &v.span(), "a whole number from 1 to 24", v.get_ref())
        })?;
        self.each(&s.fit_error, |c, v| c.number(v, "0 to 1", |v| (0.0..=1.0).contains(&v)))?;
        self.each(&s.residual_errors, |c, v| {
            let errors = v.get_ref();
            let fits = errors.is_sorted() && errors.iter().all(|e| e.is_finite());
            c.require(fits, &v.span(), "three numbers in ascending order", format!("{errors:?}"))
        })?;
        Ok(())
    }
}
