//! Our GGX against an independent renderer's: `scripts/ggx-table` makes the table.

use glam::DVec3;
use passband::reflectance::{Ggx, Reflectance};

/// Mitsuba evaluates in single precision and the table has nine digits: the worst row was measured to differ by 9e-7.
const TOLERANCE: f64 = 1e-5;

#[test]
fn agrees_with_mitsuba() {
    let table = include_str!("data/ggx/roughconductor.csv");
    let mut rows = 0;
    let mut worst = (0.0, "");
    for line in table.lines().skip(1) {
        let row: Vec<f64> = line.split(',').map(|x| x.parse().unwrap()).collect();
        let [alpha, ix, iy, iz, ox, oy, oz, expected] = row[..] else { panic!("{line}: eight columns") };
        let ggx = Ggx { alpha, f0: DVec3::ONE, albedo: DVec3::ZERO };
        ggx.validate().unwrap();
        let got = ggx.evaluate(DVec3::new(ix, iy, iz), DVec3::new(ox, oy, oz));
        assert!(got.x == got.y && got.y == got.z, "{line}: {got} is not grey");
        let error = (got.x / expected - 1.0).abs();
        if error > worst.0 {
            worst = (error, line);
        }
        rows += 1;
    }
    println!("worst of {rows}: {:.2e} at {}", worst.0, worst.1);
    assert_eq!(rows, 1000);
    assert!(worst.0 <= TOLERANCE, "{:.2e} relative at {}", worst.0, worst.1);
}
