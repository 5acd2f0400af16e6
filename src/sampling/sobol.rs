//! Deterministic points in the unit square: the first two Sobol dimensions with hash-based Owen scrambling, and plain hashed
//! random numbers. Twin of `glsl/include/sobol.glsl`, bit for bit.
//!
//! Points are built in bit-reversed form, where Owen scrambling is a hash whose every bit depends on lower bits only (Laine and
//! Karras 2011; Burley 2020, "Practical Hash-based Owen Scrambling"; multipliers by Nathan Vegdahl).

/// Added per point index before hashing (2^32 over the golden ratio).
const STEP: u32 = 0x9e37_79b9;

/// Bits of Sobol dimension 1 of point `i`, reversed (dimension 1 is the radical inverse, so this is `i` itself).
pub fn reversed_0(i: u32) -> u32 {
    i
}

/// Bits of Sobol dimension 2 of point `i`, reversed: bit `j` is the parity of the bits of `i` whose position contains `j` as a
/// bit mask (Pascal's triangle modulo 2).
pub fn reversed_1(i: u32) -> u32 {
    let mut v = i;
    v ^= v >> 16;
    v ^= (v & 0xff00_ff00) >> 8;
    v ^= (v & 0xf0f0_f0f0) >> 4;
    v ^= (v & 0xcccc_cccc) >> 2;
    v ^= (v & 0xaaaa_aaaa) >> 1;
    v
}

/// Owen-scrambles a bit-reversed coordinate and returns it in the usual bit order.
pub fn scramble(reversed: u32, seed: u32) -> u32 {
    let mut x = reversed;
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^= x.wrapping_mul(0x53a2_2864);
    x.reverse_bits()
}

/// A bijective 32-bit hash (Wellons' "lowbias32").
pub fn hash(x: u32) -> u32 {
    let mut x = x;
    x ^= x >> 16;
    x = x.wrapping_mul(0x7feb_352d);
    x ^= x >> 15;
    x = x.wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

/// Point `i` of the scrambled sequence that `seed` selects, as fractions of 2^32.
pub fn point(i: u32, seed: u32) -> [u32; 2] {
    [scramble(reversed_0(i), hash(seed)), scramble(reversed_1(i), hash(seed ^ STEP))]
}

/// Pair `i` of the independent random numbers that `seed` selects, as fractions of 2^32.
pub fn random(i: u32, seed: u32) -> [u32; 2] {
    let x = hash(i.wrapping_mul(STEP).wrapping_add(seed));
    [x, hash(x ^ 0x85eb_ca6b)]
}

/// `u / 2^32`, in `[0, 1)`.
pub fn to_unit(u: u32) -> f64 {
    f64::from(u) * (-32f64).exp2()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn second_dimension_is_that_of_the_direction_numbers() {
        // Primitive polynomial x + 1 (degree 1, no inner coefficients), first direction number 1/2: v_k+1 = v_k ^ (v_k >> 1).
        let directions: Vec<u32> = std::iter::successors(Some(0x8000_0000u32), |v| Some(v ^ (v >> 1))).take(32).collect();
        let sobol = |i: u32| (0..32).filter(|k| i >> k & 1 == 1).fold(0, |x, k| x ^ directions[k]);
        for i in (0..4096).chain((0..4096).map(|k| hash(k) | 1 << 31)) {
            assert_eq!(reversed_1(i).reverse_bits(), sobol(i), "point {i}");
        }
    }

    #[test]
    fn every_prefix_is_a_net() {
        for seed in [0, 1, 0xdead_beef, 0x1234_5678] {
            for m in 0..=10u32 {
                let points: Vec<_> = (0..1 << m).map(|i| point(i, seed)).collect();
                for a in 0..=m {
                    // One point in each of the 2^m boxes of 2^a columns and 2^(m - a) rows.
                    let mut seen = vec![false; 1 << m];
                    for &[x, y] in &points {
                        let column = (u64::from(x) << a >> 32) as usize;
                        let row = (u64::from(y) << (m - a) >> 32) as usize;
                        let at = row << a | column;
                        assert!(!std::mem::replace(&mut seen[at], true), "seed {seed}, m {m}, a {a}: box {at} twice");
                    }
                }
            }
        }
    }

    #[test]
    fn scrambling_is_uniform_over_seeds() {
        // Each coordinate of one fixed point is uniform over seeds: 16 bins, chi-square with 15 degrees of freedom.
        for i in [0, 1, 5, 63] {
            for coordinate in 0..2 {
                let mut bins = [0u32; 16];
                (0..1 << 16).for_each(|seed| bins[(point(i, seed)[coordinate] >> 28) as usize] += 1);
                let chi: f64 = bins.iter().map(|&n| (f64::from(n) - 4096.0).powi(2) / 4096.0).sum();
                assert!(chi < 50.0, "point {i}, coordinate {coordinate}: chi-square {chi}"); // p = 1e-5
            }
        }
    }

    #[test]
    fn random_pairs_are_uniform_and_uncorrelated() {
        let mut bins = [0u32; 256];
        for i in 0..1 << 18 {
            let [x, y] = random(i, 7);
            bins[(x >> 28 << 4 | y >> 28) as usize] += 1;
        }
        let chi: f64 = bins.iter().map(|&n| (f64::from(n) - 1024.0).powi(2) / 1024.0).sum();
        assert!((150.0..380.0).contains(&chi), "chi-square {chi} with 255 degrees of freedom");
    }

    #[test]
    fn known_values() {
        assert_eq!((0..4).map(|i| reversed_1(i).reverse_bits() >> 30).collect::<Vec<_>>(), [0, 2, 3, 1]);
        assert_eq!(hash(0), 0);
        assert_eq!(hash(1), 0x6889_90c0);
        assert_eq!(to_unit(0), 0.0);
        assert_eq!(to_unit(1 << 31), 0.5);
        assert!(to_unit(u32::MAX) < 1.0);
        // Pinned: the GLSL twin is compared with these.
        assert_eq!(point(0, 0), [0x0000_0000, 0x7351_2cfc]);
        assert_eq!(point(5, 1), [0x8ed8_33ce, 0x1c8f_2b85]);
        assert_eq!(random(3, 9), [0xb002_6202, 0xfacb_5883]);
    }
}
