//! The camera of one frame, as the shaders need it.

use crate::error::{Error, Result};
use glam::{Mat3, Mat4, Vec4};

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
        let sheared = [p[1], p[3], p[4], p[7], p[15]].iter().any(|&v| v != 0.0);
        let perspective = p[0] != 0.0 && p[5] != 0.0 && p[11] == -1.0 && !sheared;
        if !finite || !perspective {
            let expected = "finite matrices and a perspective projection without shear, with w = -z";
            return Err(Error::invalid("View", expected, format!("{self:?}")));
        }
        let m = self.world_from_view();
        let turn = Mat3::from_mat4(m);
        let orthonormal = (turn.transpose() * turn).abs_diff_eq(Mat3::IDENTITY, 1e-3) && turn.determinant() > 0.0;
        let rigid = orthonormal && m.row(3) == Vec4::W;
        if rigid {
            Ok(())
        } else {
            Err(Error::invalid("View::world_from_view", "a rotation and a translation", format!("{m:?}")))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_rigid_views_and_plain_projections_pass() {
        // Infinite reversed depth; a field of view of 1 radian, 3:2.
        let f = 1.0 / 0.5f32.tan();
        let columns = [[f / 1.5, 0.0, 0.0, 0.0], [0.0, f, 0.0, 0.0], [0.0, 0.0, 0.0, -1.0], [0.0, 0.0, 0.1, 0.0]];
        let projection = Mat4::from_cols_array_2d(&columns);
        let view =
            |world: Mat4, clip: Mat4| View { world_from_view: world.to_cols_array(), clip_from_view: clip.to_cols_array() };
        let turned = Mat4::from_rotation_y(0.3) * Mat4::from_translation(glam::Vec3::ONE);
        assert!(view(turned, projection).validate().is_ok());
        let squeezed = Mat4::from_scale(glam::Vec3::new(2.0, 0.5, 1.0));
        assert!(view(squeezed, projection).validate().is_err());
        assert!(view(Mat4::from_scale(-glam::Vec3::ONE), projection).validate().is_err());
        let mut sheared = projection;
        sheared.y_axis.x = 0.2;
        assert!(view(turned, sheared).validate().is_err());
        assert!(view(turned, Mat4::IDENTITY).validate().is_err(), "parallel projection");
        let ray = view(turned, projection).ray();
        assert!((ray.y - 0.5f32.tan()).abs() < 1e-6 && (ray.x / ray.y - 1.5).abs() < 1e-6);
    }
}
