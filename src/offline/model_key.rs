//! Names for what is made of a model, by its content.

use crate::reflectance::{MerlTable, Model};
use sha2::{Digest, Sha256};

/// The name of what `version` says, made with `settings` of a model's content.
pub(super) fn of(version: &[u8], settings: &[f64], model: &Model) -> String {
    let mut hash = Sha256::new();
    hash.update(version);
    settings.iter().for_each(|setting| hash.update(setting.to_le_bytes()));
    let mut table = |table: &MerlTable| {
        // What the device shades.
        let (scale, entries) = table.packed();
        hash.update(scale.to_le_bytes());
        hash.update(bytemuck::cast_slice(&entries));
    };
    match model {
        Model::Table(one) => table(one),
        Model::Turned(turned) => turned.nodes().iter().for_each(|node| table(node)),
        _ => {}
    }
    // Shortest decimals that read back as the same numbers, and the model's name.
    match model {
        Model::Table(_) => hash.update("table"),
        Model::Turned(turned) => hash.update(format!("turned {} {}", turned.symmetry(), turned.nodes().len())),
        Model::Ggx(ggx) => hash.update(format!("{ggx:?}")),
        Model::BlinnPhong(blinn_phong) => hash.update(format!("{blinn_phong:?}")),
        Model::Vmf(vmf) => hash.update(format!("{vmf:?}")),
    }
    format!("{:x}", hash.finalize())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reflectance::{Ggx, stand_in};
    use glam::DVec3;
    use std::sync::Arc;

    #[test]
    fn other_contents_have_other_names() {
        let table = |name| Model::Table(Arc::new(stand_in::table(name).unwrap()));
        let ggx = |alpha| Model::Ggx(Ggx { alpha, f0: DVec3::ONE, albedo: DVec3::ZERO });
        let mut names = [ggx(0.3), ggx(0.3 + 1e-12), table("rough"), table("rubber")].map(|m| of(b"a", &[0.1], &m)).to_vec();
        assert_eq!(of(b"a", &[0.1], &table("rough")), names[2]);
        names.extend([of(b"a", &[0.2], &table("rough")), of(b"b", &[0.1], &table("rough"))]);
        let distinct: std::collections::BTreeSet<_> = names.iter().collect();
        assert_eq!(distinct.len(), names.len());
    }
}
