// From where a further fit starts if a Gaussian has next to nothing: it has half of another's lobes then, of that whose lobes are the
// furthest from its middle (src/distribution/clustering.rs is the f64 twin). Part of mixtures/fit.comp.

// Gaussians of less of a texel's mass than this may have some of another's.
const float FREE = 1e-3;
const int HALVINGS = 4;

// What a round over the lobes is for: the middles of all, how far lobes are from these, the furthest, halves, and the moments. One loop
// does all, as drivers take long to compile many.
const int MIDDLES = 0;
const int OFF = 1;
const int FURTHEST = 2;
const int HALVES = 3;
const int MOMENTS = HALVES + HALVINGS;

// Places, logarithms of variances and one over their square roots.
struct Middles {
    vec4 x;
    vec4 y;
    vec4 logs;
    vec4 narrow;
};

// How far a lobe is from each: places over widths, and widths.
vec4 apart(vec4 lobe, float log_variance, Middles m) {
    vec4 x = lobe.x - m.x, y = lobe.y - m.y, wider = log_variance - m.logs;
    return 0.5 * (x * x + y * y) * inversesqrt(lobe.z) * m.narrow + 0.5 * wider * wider;
}

// 1 for the first of these that has next to nothing; nothing but 0 if all have something.
vec4 free_of(vec4 q) {
    vec4 less = vec4(lessThan(q, vec4(FREE * total_of(q))));
    return greatest(less) > 0.0 ? first_greatest(less) : vec4(0.0);
}

// Moments from place `at`, by the components and with that division; false if there is nothing to divide.
bool divide(Components c, vec4 free, out Sums s, out vec2 at) {
    at = vec2(0.0);
    Middles m = Middles(vec4(0.0), vec4(0.0), vec4(0.0), vec4(1.0));
    vec4 wide = vec4(0.0);
    float far = 0.0, mass = 0.0, number = 3e38;
    vec3 furthest_lobe = vec3(0.0);
    for (int round = MIDDLES; round <= MOMENTS; ++round) {
        s = NOTHING;
        vec4 other = vec4(0.0);
        for (Walk w = walk_begin(); walk_there(w); walk_next(w)) {
            vec4 lobe = walk_lobe(w), shares = first_greatest(scores(c, lobe));
            float log_variance = log(lobe.z), inside = dot(shares, wide);
            vec4 off = apart(lobe, log_variance, m);
            bool second = off.y < off.x;
            if (round == FURTHEST && inside * lobe.w * dot(off, wide) > far) {
                far = lobe.w * dot(off, wide);
                mass = lobe.w;
                furthest_lobe = vec3(lobe.xy, log_variance);
                number = walk_number(w);
            }
            if (round == MOMENTS) {
                shares = inside > 0.0 && second ? free : shares;
            } else if (round >= HALVES) {
                shares = inside * vec4(second ? 0.0 : 1.0, second ? 1.0 : 0.0, 0.0, 0.0);
            }
            add(s, shares, vec4(lobe.x - at.x), vec4(lobe.y - at.y), lobe);
            other += shares * lobe.w * (round == OFF ? off : vec4(log_variance));
        }
        all_of(s, other);
        if (round == OFF) {
            wide = first_greatest(other);
            if (dot(free, wide) > 0.0) {
                return false;
            }
        } else if (round == FURTHEST) {
            if (TOGETHER) {
                furthest(far, mass, furthest_lobe, number);
            }
            if (far <= 1e-6 * mass) {
                return false;
            }
            at = vec2(dot(wide, m.x), dot(wide, m.y));
            m.x = vec4(at.x, furthest_lobe.x, 0.0, 0.0);
            m.y = vec4(at.y, furthest_lobe.y, 0.0, 0.0);
            m.logs = vec4(dot(wide, m.logs), furthest_lobe.z, 0.0, 0.0);
        } else if (round < MOMENTS) {
            if (round >= HALVES && min(s.q.x, s.q.y) <= 0.0) {
                return false;
            }
            vec4 over = 1.0 / mix(vec4(1.0), s.q, greaterThan(s.q, vec4(0.0)));
            m.x = at.x + s.x * over;
            m.y = at.y + s.y * over;
            m.logs = other * over;
        }
        m.narrow = exp(-0.5 * m.logs);
    }
    return true;
}
