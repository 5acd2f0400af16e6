//! `sobol.glsl` against its twin, bit for bit.

use crate::{COUNT, Device};
use passband::sampling::sobol;

type Twin = fn(u32, u32) -> [u32; 2];

#[test]
fn points_agree_bit_for_bit() {
    let mut arguments: Vec<[u32; 2]> = (0..COUNT).map(|i| sobol::random(i, 20)).collect();
    // As the renderer asks: small indices under hashed seeds.
    arguments.extend((0..COUNT).map(|i| [i % 4096, sobol::hash(i)]));
    arguments.extend([0, 1, 0x8000_0000, u32::MAX].into_iter().flat_map(|i| [0, 1, u32::MAX].map(|seed| [i, seed])));
    let twins: [(&str, Twin); 4] = [
        ("hash, sobol_pascal", |i, _| [sobol::hash(i), sobol::reversed_1(i)]),
        ("owen_scramble, to_unit", |i, seed| [sobol::scramble(i, seed), (sobol::to_unit(i) * 16_777_216.0) as u32]),
        ("sobol_point", sobol::point),
        ("random_point", sobol::random),
    ];
    let mut device = Device::bare();
    for (word, (name, twin)) in (0..).zip(twins) {
        let output = device.probe("sobol", &arguments.iter().map(|&[i, seed]| [i, seed, 0, word]).collect::<Vec<_>>());
        for (&[i, seed], halves) in arguments.iter().zip(output) {
            let [a, b, c, d] = halves.map(|h| h as u32);
            assert_eq!([b << 16 | a, d << 16 | c], twin(i, seed), "{name} of {i:#x}, {seed:#x}");
        }
    }
}
