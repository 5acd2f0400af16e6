//! The scenes that need no other file, as they are in `scenes/`.

/// Their names and texts.
pub(super) const BUILTINS: [(&str, &str); 22] = [
    ("trio", include_str!("../../../scenes/trio.toml")),
    ("sphere", include_str!("../../../scenes/sphere.toml")),
    ("bumpy-sphere", include_str!("../../../scenes/bumpy-sphere.toml")),
    ("torus-knot", include_str!("../../../scenes/torus-knot.toml")),
    ("crowd", include_str!("../../../scenes/crowd.toml")),
    ("maps", include_str!("../../../scenes/maps.toml")),
    ("waves", include_str!("../../../scenes/waves.toml")),
    ("furnace", include_str!("../../../scenes/furnace.toml")),
    ("checker-plane", include_str!("../../../scenes/checker-plane.toml")),
    ("cloth-plane", include_str!("../../../scenes/cloth-plane.toml")),
    ("bumps-plane", include_str!("../../../scenes/bumps-plane.toml")),
    ("disk-plane", include_str!("../../../scenes/disk-plane.toml")),
    ("dunes-plane", include_str!("../../../scenes/dunes-plane.toml")),
    ("flake-plane", include_str!("../../../scenes/flake-plane.toml")),
    ("atlas-plane", include_str!("../../../scenes/atlas-plane.toml")),
    ("microgeometry", include_str!("../../../scenes/microgeometry.toml")),
    ("pillow", include_str!("../../../scenes/pillow.toml")),
    ("tablecloth", include_str!("../../../scenes/tablecloth.toml")),
    ("hall", include_str!("../../../scenes/hall.toml")),
    ("disk", include_str!("../../../scenes/disk.toml")),
    ("armour", include_str!("../../../scenes/armour.toml")),
    ("dunes", include_str!("../../../scenes/dunes.toml")),
];
