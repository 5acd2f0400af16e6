//! Damaged copies of a file, the same in every run.

use std::io::Write;

/// `whole` cut off at every sixteenth and one byte short, then `count` copies with one to four changed bits or bytes.
pub fn variants(whole: &[u8], count: usize) -> Vec<Vec<u8>> {
    let mut all: Vec<Vec<u8>> = (0..16).map(|i| whole[..whole.len() * i / 16].to_vec()).collect();
    all.push(whole[..whole.len() - 1].to_vec());
    let mut state = 1_u64;
    let mut random = |below: usize| {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 33) as usize % below
    };
    for _ in 0..count {
        let mut bytes = whole.to_vec();
        for _ in 0..=random(4) {
            let at = random(bytes.len());
            match random(3) {
                0 => bytes[at] ^= 1 << random(8),
                1 => bytes[at] = b" -0123456789e.\n\xff\0[{\""[random(20)],
                _ => bytes[at] = random(256) as u8,
            }
        }
        all.push(bytes);
    }
    all
}

/// `content` as a gzip file.
pub fn gzip(content: &[u8]) -> Vec<u8> {
    let mut writer = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    writer.write_all(content).unwrap();
    writer.finish().unwrap()
}
