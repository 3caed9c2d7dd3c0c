// Half of a Fourier transform along a line in shared memory, by one workgroup: natural order in, the order of the
// stages out, and the other way round. Lengths and tables: `client/glare/fourier.rs`.

layout(constant_id = 0) const uint HALF = 4;    // length; the whole transform has twice as many frequencies
layout(constant_id = 1) const uint R0 = 4;      // radices of the stages, 1 where there is none
layout(constant_id = 2) const uint R1 = 1;
layout(constant_id = 3) const uint R2 = 1;
layout(constant_id = 4) const uint R3 = 1;
layout(constant_id = 5) const uint R4 = 1;
layout(constant_id = 6) const uint R5 = 1;
layout(constant_id = 7) const uint R6 = 1;
layout(constant_id = 8) const uint R7 = 1;
const uint THREADS = 128;                       // what every device has
layout(local_size_x = 128) in;

// Span of the transforms that a stage splits.
const uint S1 = HALF / R0;
const uint S2 = S1 / R1;
const uint S3 = S2 / R2;
const uint S4 = S3 / R3;
const uint S5 = S4 / R4;
const uint S6 = S5 / R5;
const uint S7 = S6 / R6;

// e^(-2πik / 2 HALF) for all k; then, as floats, where the stages leave each frequency.
layout(std430, set = 0, binding = 0) readonly buffer Table {
    vec2 table[];
};

shared vec2 line[HALF];

vec2 times(vec2 a, vec2 b) {
    return vec2(a.x * b.x - a.y * b.y, a.x * b.y + a.y * b.x);
}

vec2 conjugate(vec2 a) {
    return vec2(a.x, -a.y);
}

// Times -i, or times i on the way back.
vec2 turned(vec2 a, bool back) {
    return back ? vec2(-a.y, a.x) : vec2(a.y, -a.x);
}

// Place of frequency k of this half.
uint place(uint k) {
    return uint(table[2u * HALF + k].x);
}

void transform(inout vec2 v[5], uint radix, bool back) {
    if (radix == 2u) {
        vec2 a = v[0];
        v[0] = a + v[1];
        v[1] = a - v[1];
    } else if (radix == 3u) {
        vec2 a = v[1] + v[2];
        vec2 b = turned(v[1] - v[2], back) * 0.8660254037844386;
        vec2 m = v[0] - 0.5 * a;
        v[0] += a;
        v[1] = m + b;
        v[2] = m - b;
    } else if (radix == 4u) {
        vec2 a = v[0] + v[2];
        vec2 b = v[0] - v[2];
        vec2 c = v[1] + v[3];
        vec2 d = turned(v[1] - v[3], back);
        v[0] = a + c;
        v[1] = b + d;
        v[2] = a - c;
        v[3] = b - d;
    } else {
        const vec2 C = vec2(0.30901699437494745, -0.8090169943749475);
        const vec2 S = vec2(0.9510565162951535, 0.5877852522924731);
        vec2 a = v[1] + v[4];
        vec2 b = v[2] + v[3];
        vec2 c = v[1] - v[4];
        vec2 d = v[2] - v[3];
        vec2 m = v[0] + C.x * a + C.y * b;
        vec2 n = v[0] + C.y * a + C.x * b;
        vec2 p = turned(S.x * c + S.y * d, back);
        vec2 q = turned(S.y * c - S.x * d, back);
        v[0] += a + b;
        v[1] = m + p;
        v[2] = n + q;
        v[3] = n - q;
        v[4] = m - p;
    }
}

void stage(uint radix, uint span, bool back) {
    uint part = span / radix;
    uint unit = 2u * HALF / span;
    for (uint i = gl_LocalInvocationIndex; i < HALF / radix; i += THREADS) {
        uint q = i % part;
        uint first = (i / part) * span + q;
        vec2 v[5];
        for (uint r = 0u; r < radix; r++) {
            v[r] = line[first + r * part];
            if (back && r > 0u) {
                v[r] = times(v[r], conjugate(table[q * r * unit]));
            }
        }
        transform(v, radix, back);
        for (uint r = 0u; r < radix; r++) {
            if (!back && r > 0u) {
                v[r] = times(v[r], table[q * r * unit]);
            }
            line[first + r * part] = v[r];
        }
    }
    barrier();
}

// Transforms the contents of `line` to frequencies.
void forward() {
    barrier();
    if (R0 > 1u) stage(R0, HALF, false);
    if (R1 > 1u) stage(R1, S1, false);
    if (R2 > 1u) stage(R2, S2, false);
    if (R3 > 1u) stage(R3, S3, false);
    if (R4 > 1u) stage(R4, S4, false);
    if (R5 > 1u) stage(R5, S5, false);
    if (R6 > 1u) stage(R6, S6, false);
    if (R7 > 1u) stage(R7, S7, false);
}

// Transforms frequencies back to the line, times HALF.
void backward() {
    barrier();
    if (R7 > 1u) stage(R7, S7, true);
    if (R6 > 1u) stage(R6, S6, true);
    if (R5 > 1u) stage(R5, S5, true);
    if (R4 > 1u) stage(R4, S4, true);
    if (R3 > 1u) stage(R3, S3, true);
    if (R2 > 1u) stage(R2, S2, true);
    if (R1 > 1u) stage(R1, S1, true);
    if (R0 > 1u) stage(R0, HALF, true);
}
