#include "tests/support/reference.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace relit::reference {
namespace {

constexpr double pi = 3.14159265358979323846;
constexpr double inf = std::numeric_limits<double>::infinity();

// ---- Section 1: the solid
// -------------------------------------------------------------------------------------------

double texel_z(const Scene& s, int i, int j) {
    i = std::clamp(i, 0, s.field->width() - 1);
    j = std::clamp(j, 0, s.field->height() - 1);
    return s.relief * s.field->heights.at(i, j);
}

bool material(const Scene& s, int i, int j) {
    return i >= 0 && j >= 0 && i < s.field->width() && j < s.field->height() &&
           (s.field->alpha.empty() || s.field->alpha.at(i, j) >= 0.5f);
}

bool no_floor(const Scene& s) { return s.base.kind == Base::Kind::none; }

double floor_z(const Scene& s) {
    if (no_floor(s)) return -inf;
    return s.base.kind == Base::Kind::automatic ? -s.material.depth : s.base.level;
}

// How high the material reaches above (x, y): the surface on the map, the ground (or nothing)
// elsewhere.
double height_above(const Scene& s, double x, double y) {
    const int W = s.field->width(), H = s.field->height();
    const double column = x * W - 0.5, row = H - 0.5 - y * W;
    const bool on_map = x >= 0 && x <= 1 && y >= 0 && y <= double(H) / W;
    const int nearest_i = std::clamp(int(std::floor(column + 0.5)), 0, W - 1);
    const int nearest_j = std::clamp(int(std::floor(row + 0.5)), 0, H - 1);
    if (!on_map || !material(s, nearest_i, nearest_j)) return no_floor(s) ? 0 : -inf;
    const int i = int(std::floor(column)), j = int(std::floor(row));
    const double a = column - i, b = row - j;
    return (1 - a) * (1 - b) * texel_z(s, i, j) + a * (1 - b) * texel_z(s, i + 1, j) +
           (1 - a) * b * texel_z(s, i, j + 1) + a * b * texel_z(s, i + 1, j + 1);
}

// ---- Section 2: illumination
// ----------------------------------------------------------------------------------------

struct Sample {
    Vec3 at;
    bool infinite;
    double weight;
    double colour[3];  // intensity times colour
};

// Inside length from `p` along unit `l` over `distance`, marched densely; crossings by linear
// interpolation.
double inside_length(const Scene& s, Vec3 p, Vec3 l, double distance, double step_texels) {
    if (no_floor(s) &&
        (distance == inf ? l.z < 0 || (l.z == 0 && p.z < 0) : p.z + distance * l.z < 0))
        return inf;               // the light is behind endless ground, or in it
    const double top = s.relief;  // heights are at most 1
    double end = std::min(
        distance, 5.0 + std::abs(p.x) + std::abs(p.y));  // farther than any way over the map
    double in_ground_beyond = 0;
    if (l.z > 0) {
        const double leaves_top = std::max(0.0, (std::max(top, 0.0) - p.z) / l.z);
        if (leaves_top > end && no_floor(s))
            in_ground_beyond = std::max(0.0, std::min(distance, -p.z / l.z) - end);
        end = std::min(end, leaves_top);
    }
    const double step = step_texels / s.field->width();
    const int steps = std::max(1, int(std::ceil(end / step)));
    const auto excess = [&](double at) {
        return height_above(s, p.x + at * l.x, p.y + at * l.y) - (p.z + at * l.z);
    };
    const auto above_floor = [&](double at) { return p.z + at * l.z - floor_z(s); };
    // Share of a step that a quantity running from a to b is positive.
    const auto share = [](double a, double b) {
        if (a > 0 && b > 0) return 1.0;
        if (a <= 0 && b <= 0) return 0.0;
        if (std::isinf(a) || std::isinf(b)) return 0.5;  // a wall somewhere in the step
        return std::max(a, b) / (std::abs(a) + std::abs(b));
    };
    double r = 0;
    double e0 = excess(0);
    for (int k = 0; k < steps; ++k) {
        const double s0 = end * k / steps, s1 = end * (k + 1) / steps;
        const double e1 = excess(s1);
        r += (s1 - s0) * std::min(share(e0, e1), share(above_floor(s0), above_floor(s1)));
        e0 = e1;
    }
    return r + in_ground_beyond;
}

bool inside(const Scene& s, Vec3 q) { return q.z >= floor_z(s) && q.z < height_above(s, q.x, q.y); }

// The thesis's pseudo-code.
double count_illumination(const Scene& scene, Vec3 p, Vec3 L) {
    const int S = scene.material.steps;
    const Vec3 inc{(L.x - p.x) / S, (L.y - p.y) / S, (L.z - p.z) / S};
    int s = 1;
    for (int i = 0; i <= S; ++i)
        if (inside(scene, {p.x + i * inc.x, p.y + i * inc.y, p.z + i * inc.z})) s += 1;
    return 1.0 / s;
}

double illumination(const Scene& s, Vec3 p, Vec3 l, double distance, double step, double& r) {
    const Material& m = s.material;
    if (m.illumination == Illumination::count) return count_illumination(s, p, p + distance * l);
    r = inside_length(s, p, l, distance, step);
    if (m.illumination == Illumination::exponential)
        return std::exp(-m.attenuation * std::max(0.0, r - m.depth));
    return r == 0 ? 1 : std::min(1.0, m.depth / r);
}

// ---- Section 3: normals
// ---------------------------------------------------------------------------------------------

Vec3 normal(const Scene& s, int i, int j, double scale) {
    const double texel = 1.0 / s.field->width();
    const auto slope = [&](int i0, int j0, int i1, int j1) {  // from neighbour 0 to neighbour 1
        const bool m0 = material(s, i0, j0), m1 = material(s, i1, j1);
        const double z = texel_z(s, i, j);
        if (m0 && m1) return (texel_z(s, i1, j1) - texel_z(s, i0, j0)) / (2 * texel);
        if (m0) return (z - texel_z(s, i0, j0)) / texel;
        if (m1) return (texel_z(s, i1, j1) - z) / texel;
        return 0.0;
    };
    const double dx = scale * slope(i - 1, j, i + 1, j), dy = scale * slope(i, j + 1, i, j - 1);
    const double n = std::sqrt(dx * dx + dy * dy + 1);
    return {-dx / n, -dy / n, 1 / n};
}

// ---- Sections 1 and 6: lights as samples
// ----------------------------------------------------------------------------

double linear(const Colour& c, int channel) {
    const double v = c.values[channel];
    if (!c.hex) return v;
    return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
}

void add_samples(const Scene& s, const PointLight& light, std::vector<Sample>& out) {
    const double y_size = double(s.field->height()) / s.field->width();
    Sample q{{light.position.x, light.position.y * y_size, light.position.z}, false, 1, {}};
    for (int c = 0; c < 3; ++c) q.colour[c] = light.intensity * linear(light.colour, c);
    out.push_back(q);
}

void add_samples(const Scene&, const DirectionalLight& light, std::vector<Sample>& out) {
    const double az = light.azimuth_deg * pi / 180, el = light.elevation_deg * pi / 180;
    Vec3 l{std::sin(az) * std::cos(el), std::cos(az) * std::cos(el), std::sin(el)};
    if (light.direction) l = (1 / length(*light.direction)) * *light.direction;
    Sample q{l, true, 1, {}};
    for (int c = 0; c < 3; ++c) q.colour[c] = light.intensity * linear(light.colour, c);
    out.push_back(q);
}

void add_samples(const Scene& s, const EnvironmentLight& light, std::vector<Sample>& out) {
    const Image& map = *light.map;
    double weights = 0, solid_angles = 0, luminances = 0;
    std::vector<Sample> texels;
    for (int j = 0; j < map.height; ++j)
        for (int i = 0; i < map.width; ++i) {
            const double lam = 2 * pi * ((i + 0.5) / map.width - 0.5),
                         phi = pi * (0.5 - (j + 0.5) / map.height);
            const Vec3 l{-std::sin(lam) * std::cos(phi), std::sin(phi),
                         std::cos(lam) * std::cos(phi)};
            const double yaw = light.rotation.yaw_deg * pi / 180,
                         pitch = light.rotation.pitch_deg * pi / 180;
            const Vec3 a{std::cos(yaw) * l.x + std::sin(yaw) * l.z, l.y,
                         -std::sin(yaw) * l.x + std::cos(yaw) * l.z};
            const Vec3 b{a.x, std::cos(pitch) * a.y - std::sin(pitch) * a.z,
                         std::sin(pitch) * a.y + std::cos(pitch) * a.z};
            Sample q{b, true, light.weighting == Weighting::uniform ? 1.0 : std::cos(phi), {}};
            for (int c = 0; c < 3; ++c) q.colour[c] = map.at(i, j, c);
            weights += q.weight;
            solid_angles += std::cos(phi);
            luminances += std::cos(phi) *
                          (0.2126 * q.colour[0] + 0.7152 * q.colour[1] + 0.0722 * q.colour[2]);
            texels.push_back(q);
        }
    const double intensity = light.intensity.value_or(1.6 / (luminances / solid_angles));
    for (Sample& q : texels) {
        q.weight /= weights;
        for (double& c : q.colour) c *= intensity;
        if (light.radius) {
            q.infinite = false;
            q.at = Vec3{0.5, 0.5 * s.field->height() / s.field->width(), 0} + *light.radius * q.at;
        }
        out.push_back(q);
    }
}

double ramp(double c, Falloff f) { return std::clamp((c - f.lo) / (f.hi - f.lo), 0.0, 1.0); }

}  // namespace

// ---- Sections 4 and 5: the colour of a pixel
// ------------------------------------------------------------------------

Result shade(const Scene& scene, int i, int j, double step) {
    const Material& m = scene.material;
    const Vec3 n = normal(scene, i, j, 1), gloss_n = normal(scene, i, j, scene.normal_scale);
    const double W = scene.field->width(), H = scene.field->height();
    const Vec3 p{(i + 0.5) / W, (H - 0.5 - j) / W, texel_z(scene, i, j)};
    const Vec3 from = p - m.depth * (m.offset == Offset::normal ? n : Vec3{0, 0, 1});
    const Vec3 R{2 * gloss_n.z * gloss_n.x, 2 * gloss_n.z * gloss_n.y,
                 2 * gloss_n.z * gloss_n.z - 1};
    const double ks = m.specular.k, kf = m.scatter.k;

    Result result;
    for (int c = 0; c < 3; ++c) result.colour[c] = (1 - ks) * linear(m.base_colour, c);
    for (std::size_t light = 0; light < scene.lights.size(); ++light) {
        std::vector<Sample> samples;
        std::visit([&](const auto& l) { add_samples(scene, l, samples); }, scene.lights[light]);
        for (const Sample& q : samples) {
            const double distance = q.infinite ? inf : length(q.at - from);
            const Vec3 l = q.infinite ? q.at : (1 / distance) * (q.at - from);
            double r = 0;
            const double d = illumination(scene, from, l, distance, step, r);
            const double s = ramp(dot(R, l), m.specular.falloff);
            const double f = ramp(-l.z, m.scatter.falloff);
            for (int c = 0; c < 3; ++c) {
                const double albedo =
                    scene.field->albedo.empty() ? 1 : scene.field->albedo.at(i, j, c);
                const double diffuse =
                    (1 - ks) * ((1 - kf) + kf * f) * d * linear(m.diffuse_colour, c) * albedo;
                const double glossy =
                    ks * s * (m.specular.occlude ? d : 1) * linear(m.specular_colour, c);
                result.colour[c] += q.weight * q.colour[c] * (diffuse + glossy);
            }
            if (light == 0) result.illumination += q.weight * d;
            if (light == 0 && &q == &samples.front()) result.r = r;
        }
    }
    return result;
}

}  // namespace relit::reference
