// The mean of signal and noise over the pixel and its neighbours, all of them alike.
vec2 mean_power(sampler2D power, sampler2D weights, ivec2 at) {
    vec2 sum = texelFetch(power, at, 0).xy;
    float total = 1.0;
    for (int i = 0; i < 8; ++i) {
        float w = weight_to(weights, at, i);
        if (w > 0.0) {
            sum += w * texelFetch(power, at + NEIGHBOURS[i] * push.step, 0).xy;
            total += w;
        }
    }
    return sum / total;
}
