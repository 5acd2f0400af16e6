// From where a further fit starts if a Gaussian has next to nothing: it has half of another's lobes then, of that whose lobes are the
// furthest from its middle (src/distribution/clustering.rs is the f64 twin). Part of mixtures/fit.comp.

// Gaussians of less of a texel's mass than this may have some of another's.
const float FREE = 1e-3;
const int HALVINGS = 4;

// How far lobes are from some of these places, of these logarithms of variances: places over widths, and widths.
vec4 apart(vec4 lobe, vec4 x, vec4 y, vec4 log_variance) {
    vec4 off_x = lobe.x - x, off_y = lobe.y - y, wider = log(lobe.z) - log_variance;
    return 0.5 * (off_x * off_x + off_y * off_y) * inversesqrt(lobe.z * exp(log_variance)) + 0.5 * wider * wider;
}

// 1 for the first of these that has next to nothing; nothing but 0 if all have something.
vec4 free_of(vec4 q) {
    vec4 less = vec4(lessThan(q, vec4(FREE * total_of(q))));
    return greatest(less) > 0.0 ? first_greatest(less) : vec4(0.0);
}

// Moments from place `at`, by the components and with that division; false if there is nothing to divide.
bool divide(Components c, vec4 free, out Sums s, out vec2 at) {
    s = NOTHING;
    at = vec2(0.0);
    vec4 mass = vec4(0.0), x = vec4(0.0), y = vec4(0.0), logs = vec4(0.0);
    for (Walk w = walk_begin(); walk_there(w); walk_next(w)) {
        vec4 lobe = walk_lobe(w), own = first_greatest(scores(c, lobe)) * lobe.w;
        mass += own;
        x += own * lobe.x;
        y += own * lobe.y;
        logs += own * log(lobe.z);
    }
    if (TOGETHER) {
        put(0, mass);
        put(1, x);
        put(2, y);
        put(3, logs);
        add_up(4);
        mass = got(0);
        x = got(1);
        y = got(2);
        logs = got(3);
    }
    vec4 over = 1.0 / mix(vec4(1.0), mass, greaterThan(mass, vec4(0.0)));
    x *= over;
    y *= over;
    logs *= over;

    vec4 off = vec4(0.0);
    for (Walk w = walk_begin(); walk_there(w); walk_next(w)) {
        vec4 lobe = walk_lobe(w);
        off += first_greatest(scores(c, lobe)) * lobe.w * apart(lobe, x, y, logs);
    }
    if (TOGETHER) {
        put(0, off);
        add_up(1);
        off = got(0);
    }
    vec4 wide = first_greatest(off);
    // Place and logarithm of the variance of its middle, and of its furthest lobe.
    vec3 one = vec3(dot(wide, x), dot(wide, y), dot(wide, logs)), two = one;
    float far = 0.0, mass_there = 0.0;
    float number = 3e38;
    for (Walk w = walk_begin(); walk_there(w); walk_next(w)) {
        vec4 lobe = walk_lobe(w);
        float its = dot(first_greatest(scores(c, lobe)), wide) * lobe.w * apart(lobe, one.xxxx, one.yyyy, one.zzzz).x;
        if (its > far) {
            far = its;
            mass_there = lobe.w;
            two = vec3(lobe.xy, log(lobe.z));
            number = walk_number(w);
        }
    }
    if (TOGETHER) {
        furthest(far, mass_there, two, number);
    }
    if (dot(free, wide) > 0.0 || far <= 1e-6 * mass_there) {
        return false;
    }
    at = one.xy;
    for (int i = 0; i < HALVINGS; ++i) {
        vec4 near_one = vec4(0.0), near_two = vec4(0.0);
        for (Walk w = walk_begin(); walk_there(w); walk_next(w)) {
            vec4 lobe = walk_lobe(w);
            float own = dot(first_greatest(scores(c, lobe)), wide) * lobe.w;
            vec4 to = apart(lobe, vec4(one.x, two.x, 0.0, 0.0), vec4(one.y, two.y, 0.0, 0.0), vec4(one.z, two.z, 0.0, 0.0));
            vec4 its = own * vec4(1.0, lobe.xy, log(lobe.z));
            near_one += to.y < to.x ? vec4(0.0) : its;
            near_two += to.y < to.x ? its : vec4(0.0);
        }
        if (TOGETHER) {
            put(0, near_one);
            put(1, near_two);
            add_up(2);
            near_one = got(0);
            near_two = got(1);
        }
        if (near_one.x <= 0.0 || near_two.x <= 0.0) {
            return false;
        }
        one = near_one.yzw / near_one.x;
        two = near_two.yzw / near_two.x;
    }
    for (Walk w = walk_begin(); walk_there(w); walk_next(w)) {
        vec4 lobe = walk_lobe(w), label = first_greatest(scores(c, lobe));
        vec4 to = apart(lobe, vec4(one.x, two.x, 0.0, 0.0), vec4(one.y, two.y, 0.0, 0.0), vec4(one.z, two.z, 0.0, 0.0));
        add(s, dot(label, wide) > 0.0 && to.y < to.x ? free : label, vec4(lobe.x - at.x), vec4(lobe.y - at.y), lobe);
    }
    float none = 0.0;
    all_of(s, none);
    return true;
}
