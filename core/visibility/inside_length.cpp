#include "core/visibility/inside_length.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace relit {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

struct Interval {
    double begin = 0;
    double end = 0;
};

// Narrows `s` to where lo <= origin + s * speed <= hi.
Interval clip(Interval s, double origin, double speed, double lo, double hi) {
    if (speed == 0) return lo <= origin && origin <= hi ? s : Interval{0, 0};
    const double at_lo = (lo - origin) / speed;
    const double at_hi = (hi - origin) / speed;
    return {std::max(s.begin, std::min(at_lo, at_hi)), std::min(s.end, std::max(at_lo, at_hi))};
}

// Share of 0 <= s <= 1 where the parabola through (0, e0), (1/2, em), (1, e1) is positive.
double positive_share(double e0, double em, double e1) {
    const double a = 2 * (e0 + e1) - 4 * em;
    const double b = e1 - e0 - a;
    const double discriminant = b * b - 4 * a * e0;
    if (discriminant <= 0) return em > 0 ? 1 : 0;
    // Citardauq form: no cancellation, and the straight line (a = 0) is no special case.
    const double q = -0.5 * (b + std::copysign(std::sqrt(discriminant), b));
    double root1 = e0 / q;
    double root2 = a != 0 ? q / a : infinity;
    if (root1 > root2) std::swap(root1, root2);
    const double between = std::clamp(root2, 0.0, 1.0) - std::clamp(root1, 0.0, 1.0);
    const bool positive_between = a != 0 ? a < 0 : b > 0;
    return positive_between ? between : 1 - between;
}

// A ray in texel coordinates (Solid); s is the distance from its start in scene units.
struct TexelRay {
    double u, v, z;
    double du, dv, dz;
};

// One cell of the grid and the ray's height above it.
struct Cell {
    float z00, z10, z01, z11;

    double excess(const TexelRay& ray, int i, int j, double s) const {
        const double a = ray.u + s * ray.du - i;
        const double b = ray.v + s * ray.dv - j;
        const double upper = z00 + a * (double(z10) - z00);
        const double lower = z01 + a * (double(z11) - z01);
        return upper + b * (lower - upper) - (ray.z + s * ray.dz);
    }
};

// Length below the surface between s0 and s1, which lie in one cell, wholly material.
double length_below(const Cell& cell, const TexelRay& ray, int i, int j, double s0, double s1) {
    const double z_begin = ray.z + s0 * ray.dz;
    const double z_end = ray.z + s1 * ray.dz;
    const auto [lowest, highest] = std::minmax({cell.z00, cell.z10, cell.z01, cell.z11});
    if (std::min(z_begin, z_end) >= highest) return 0;
    if (std::max(z_begin, z_end) < lowest) return s1 - s0;
    return (s1 - s0) * positive_share(cell.excess(ray, i, j, s0),
                                      cell.excess(ray, i, j, 0.5 * (s0 + s1)),
                                      cell.excess(ray, i, j, s1));
}

// The same where the four texels around the cell are not all material: each quarter of the cell
// belongs to the nearest one.
double length_below_masked(const Cell& cell, const TexelRay& ray, int i, int j, double s0,
                           double s1, unsigned cover) {
    const auto crossing = [&](double origin, double speed, double line) {
        const double s = speed != 0 ? (line - origin) / speed : s0;
        return std::clamp(s, s0, s1);
    };
    double cuts[4] = {s0, crossing(ray.u, ray.du, i + 0.5), crossing(ray.v, ray.dv, j + 0.5), s1};
    if (cuts[1] > cuts[2]) std::swap(cuts[1], cuts[2]);
    double sum = 0;
    for (int k = 0; k < 3; ++k) {
        const double middle = 0.5 * (cuts[k] + cuts[k + 1]);
        const unsigned right = ray.u + middle * ray.du >= i + 0.5 ? 1 : 0;
        const unsigned lower = ray.v + middle * ray.dv >= j + 0.5 ? 1 : 0;
        if (cover >> (right + 2 * lower) & 1)
            sum += length_below(cell, ray, i, j, cuts[k], cuts[k + 1]);
    }
    return sum;
}

// One axis of a walk over the grid's cells.
struct AxisWalk {
    double origin, speed, inverse_speed;  // texel coordinates, per scene unit
    int index;                            // of the cell
    double leaves_cell;                   // where the ray leaves its column or row of cells

    AxisWalk(double from, double per_unit, double begin, int last_cell)
        : origin(from),
          speed(per_unit),
          inverse_speed(1 / per_unit),
          index(std::clamp(int(std::floor(from + begin * per_unit)), 0, last_cell)),
          leaves_cell(leaves_at(1)) {}

    // Where it leaves the `size` columns or rows, aligned to multiples of `size`, that hold the
    // cell.
    [[nodiscard]] double leaves_at(int size) const {
        if (speed == 0) return infinity;
        const int first = index - index % size;
        return ((speed > 0 ? first + size : first) - origin) * inverse_speed;
    }

    void step() { move_to_cell(speed > 0 ? index + 1 : index - 1); }

    // To the cell at `s`, just beyond the block of `size` that holds the present cell or, if not
    // `beyond`, in it.
    void move_to(double s, int size, bool beyond) {
        const int first = index - index % size;
        if (beyond) move_to_cell(speed > 0 ? first + size : first - 1);
        else move_to_cell(std::clamp(int(std::floor(origin + s * speed)), first, first + size - 1));
    }

private:
    void move_to_cell(int cell) {
        index = cell;
        leaves_cell = leaves_at(1);
    }
};

// The cells that a ray crosses, one after the other (Amanatides and Woo 1987), or a block of them
// at a time.
struct GridWalk {
    AxisWalk across, down;
    int columns, rows;

    GridWalk(const Solid& solid, const TexelRay& ray, double begin)
        : across(ray.u, ray.du, begin, solid.width),
          down(ray.v, ray.dv, begin, solid.height),
          columns(solid.width + 1),
          rows(solid.height + 1) {}

    [[nodiscard]] bool is_on_grid() const {
        return across.index >= 0 && across.index < columns && down.index >= 0 && down.index < rows;
    }
    [[nodiscard]] double leaves_cell() const {
        return std::min(across.leaves_cell, down.leaves_cell);
    }
    [[nodiscard]] double leaves_block(int size) const {
        return std::min(across.leaves_at(size), down.leaves_at(size));
    }

    void to_next_cell() {
        if (across.leaves_cell <= down.leaves_cell) across.step();
        else down.step();
    }
    void to_next_block(int size) {
        const double by_column = across.leaves_at(size), by_row = down.leaves_at(size);
        const bool column_first = by_column <= by_row;
        across.move_to(by_row, size, column_first);
        down.move_to(by_column, size, !column_first);
    }
};

// Length below the surface in the walk's cell, between s0 and s1.
double length_in_cell(const Solid& solid, const TexelRay& ray, int i, int j, double s0, double s1) {
    const unsigned cover =
        solid.cover.empty() ? 15u : solid.cover[std::size_t(j) * (solid.width + 1) + i];
    if (cover == 0) return 0;
    const float* upper = solid.z.row(j) + i;
    const float* lower = upper + solid.z.pitch;
    const Cell cell{upper[0], upper[1], lower[0], lower[1]};
    return cover == 15 ? length_below(cell, ray, i, j, s0, s1)
                       : length_below_masked(cell, ray, i, j, s0, s1, cover);
}

// Cell by cell, but in one stride through every block of cells that the ray passes wholly above or
// wholly inside the material.
double march(const Solid& solid, const TexelRay& ray, Interval s) {
    constexpr int block_size = Solid::block_size;
    GridWalk walk(solid, ray, s.begin);
    double sum = 0;
    double block_end = s.begin;  // where the present block has been checked up to
    for (double at = s.begin; at < s.end && walk.is_on_grid();) {
        if (at >= block_end) {
            block_end = std::max(at, std::min(walk.leaves_block(block_size), s.end));
            const double z_begin = ray.z + at * ray.dz;
            const double z_end = ray.z + block_end * ray.dz;
            const Block& block = solid.block_of_cell(walk.across.index, walk.down.index);
            const bool inside = std::max(z_begin, z_end) < block.bottom;
            if (inside || std::min(z_begin, z_end) >= block.top) {
                if (inside) sum += block_end - at;
                at = block_end;
                walk.to_next_block(block_size);
                continue;
            }
        }
        const double end = std::max(at, std::min(walk.leaves_cell(), s.end));
        sum += length_in_cell(solid, ray, walk.across.index, walk.down.index, at, end);
        at = end;
        walk.to_next_cell();
    }
    return sum;
}

}  // namespace

double inside_length(const Solid& solid, const Ray& ray) noexcept {
    const Vec3 from = ray.from;
    const Vec3 direction = ray.direction;
    double in_ground = 0;
    if (solid.endless_ground) {
        if (ray.end_z < 0) return infinity;
        // It ends above the ground, so it rises, unless the rise is a trace.
        if (from.z < 0) in_ground = std::min(ray.distance, -from.z / direction.z);
    }
    Interval s{0, ray.distance};
    s = clip(s, from.x, direction.x, 0, 1);
    s = clip(s, from.y, direction.y, 0, solid.y_size());
    s = clip(s, from.z, direction.z, solid.floor_z, solid.top_z);
    if (!(s.begin < s.end)) return in_ground;
    const TexelRay texels{solid.u_of(from.x),        solid.v_of(from.y),         from.z,
                          direction.x * solid.width, -direction.y * solid.width, direction.z};
    return in_ground + march(solid, texels, s);
}

}  // namespace relit
