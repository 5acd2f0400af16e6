//! The camera of one frame, as the shaders need it.

use crate::error::{Error, Result};
use glam::{Mat4, Vec4};

/// A pinhole view. Matrices are column-major; the view space looks along -z, +y up; clip space is Vulkan's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// World from view: a rotation and the eye's position.
    pub world_from_view: [f32; 16],
    /// Clip from view: any perspective projection, off-centre, reversed or infinite.
    pub clip_from_view: [f32; 16],
}

impl View {
    pub(crate) fn world_from_view(&self) -> Mat4 {
        Mat4::from_cols_array(&self.world_from_view)
    }

    pub(crate) fn clip_from_world(&self) -> Mat4 {
        Mat4::from_cols_array(&self.clip_from_view) * self.world_from_view().inverse()
    }

    /// View-space x and y at unit depth as `ndc * xy + zw`.
    pub(crate) fn ray(&self) -> Vec4 {
        let p = Mat4::from_cols_array(&self.clip_from_view);
        Vec4::new(1.0 / p.x_axis.x, 1.0 / p.y_axis.y, p.z_axis.x / p.x_axis.x, p.z_axis.y / p.y_axis.y)
    }

    pub(crate) fn validate(&self) -> Result<()> {
        let p = &self.clip_from_view;
        let finite = self.world_from_view.iter().chain(p).all(|v| v.is_finite());
        let perspective = p[0] != 0.0 && p[5] != 0.0 && p[11] == -1.0 && p[15] == 0.0;
        if !finite || !perspective {
            let expected = "finite matrices and a perspective projection with w = -z";
            return Err(Error::invalid("View", expected, format!("{self:?}")));
        }
        let m = self.world_from_view();
        let rigid = (m.determinant() - 1.0).abs() < 1e-3 && m.row(3) == Vec4::W;
        if rigid {
            Ok(())
        } else {
            Err(Error::invalid("View::world_from_view", "a rotation and a translation", format!("{m:?}")))
        }
    }
}
