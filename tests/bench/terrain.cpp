#include "tests/bench/terrain.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "tests/support/maps.h"

namespace relit::bench {
namespace {

// Value noise of halving wavelength and amplitude: a terrain that is as rough at every scale.
HeightField make_terrain(int size) {
    const auto lattice = [](int octave, int x, int y) {
        return test::Random(std::uint64_t(octave) << 40 | std::uint64_t(x) << 20 |
                            std::uint64_t(y))();
    };
    const auto smooth = [](double t) { return t * t * (3 - 2 * t); };
    HeightField field = test::field_of(size, size, [&](int i, int j) {
        double sum = 0, amplitude = 0.5;
        for (int octave = 0, cells = 3; octave < 8; ++octave, cells *= 2, amplitude *= 0.5) {
            const double x = (i + 0.5) / size * cells, y = (j + 0.5) / size * cells;
            const int cx = int(x), cy = int(y);
            const double a = smooth(x - cx), b = smooth(y - cy);
            const double above = std::lerp(lattice(octave, cx, cy), lattice(octave, cx + 1, cy), a);
            const double below =
                std::lerp(lattice(octave, cx, cy + 1), lattice(octave, cx + 1, cy + 1), a);
            sum += amplitude * std::lerp(above, below, b);
        }
        return sum;
    });
    const auto [lo, hi] =
        std::minmax_element(field.heights.values.begin(), field.heights.values.end());
    const float low = *lo, span = *hi - *lo;
    for (float& h : field.heights.values) h = (h - low) / span;
    return field;
}

}  // namespace

const HeightField& terrain(int size) {
    static std::map<int, HeightField> made;
    const auto found = made.find(size);
    return found != made.end() ? found->second
                               : made.emplace(size, make_terrain(size)).first->second;
}

}  // namespace relit::bench
