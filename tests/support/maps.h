// Small made-up height maps and scenes for tests of core.
#pragma once

#include <cmath>
#include <cstdint>

#include "core/render/render.h"

namespace relit::test {

/// One executor for a test program; results do not depend on its threads.
inline const Executor& executor() {
    static const Executor shared(2);
    return shared;
}

inline Image rendered(const Scene& scene, const Output& output = {}) {
    return render(scene, output, {executor()}).pixels;
}

/// A map as scenes hold it.
inline std::shared_ptr<const HeightField> shared(HeightField field) {
    return std::make_shared<const HeightField>(std::move(field));
}

/// A scene's map, to be changed: it gets one of its own.
inline HeightField& own_field(Scene& scene) {
    auto own = std::make_shared<HeightField>(*scene.field);
    scene.field = own;
    return *own;
}

/// h(i, j) for every texel.
template <class Height>
HeightField field_of(int width, int height, const Height& h) {
    HeightField field;
    field.heights = Image(width, height, 1);
    for (int j = 0; j < height; ++j)
        for (int i = 0; i < width; ++i) field.heights.at(i, j) = float(h(i, j));
    return field;
}

/// The plane z = relief * h that rises by `dz_dx` and `dz_dy` per scene unit, with 0.5 * relief in
/// its middle.
inline HeightField tilted_plane(int width, int height, double relief, double dz_dx, double dz_dy) {
    return field_of(width, height, [&](int i, int j) {
        const double x = (i + 0.5) / width - 0.5;
        const double y = (0.5 * height - 0.5 - j) / width;
        return 0.5 + (x * dz_dx + y * dz_dy) / relief;
    });
}

/// Numbers in [0, 1), the same on every machine (Steele and others 2014, SplitMix64).
class Random {
public:
    explicit Random(std::uint64_t seed) : state_(seed) {}
    double operator()() {
        std::uint64_t z = (state_ += 0x9e3779b97f4a7c15u);
        z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
        z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
        return double((z ^ (z >> 31)) >> 11) * 0x1p-53;
    }

private:
    std::uint64_t state_;
};

/// Smooth hills: a sum of a few waves, the same for the same seed.
inline HeightField hills(int width, int height, std::uint64_t seed = 1) {
    Random random(seed);
    struct Wave {
        double kx, ky, phase;
    };
    Wave waves[6];
    for (Wave& w : waves) w = {random() * 20 - 10, random() * 20 - 10, random() * 6.28};
    return field_of(width, height, [&](int i, int j) {
        const double x = (i + 0.5) / width, y = (j + 0.5) / width;
        double sum = 0;
        for (const Wave& w : waves) sum += std::sin(w.kx * x + w.ky * y + w.phase);
        return 0.5 + sum / 12;
    });
}

/// Noise of 1 to 9 texels a side, masked every other time, on each kind of base in turn; relief 0.7,
/// depth 0.05.
inline Solid rough_solid(int trial, Random& random) {
    const int width = 1 + int(random() * 9), height = 1 + int(random() * 9);
    HeightField field = field_of(width, height, [&](int, int) { return random(); });
    if (trial % 2 == 0) {
        field.alpha = Image(width, height, 1);
        for (float& a : field.alpha.values) a = random() < 0.6 ? 1.0f : 0.0f;
    }
    const Base bases[] = {
        {}, {Base::Kind::automatic, 0}, {Base::Kind::level, 0.4}, {Base::Kind::level, -0.1}};
    return make_solid(field, 0.7, bases[trial % 4], 0.05);
}

}  // namespace relit::test
