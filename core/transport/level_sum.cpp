#include "core/transport/level_sum.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>

#include "core/base/error.h"

namespace relit {
namespace {

constexpr int level_margin = 4;  // that cubics of the next level reach, whatever the level
constexpr int least_pad = 12;    // that flux is carried from: 8 nodes around twice the margin
constexpr int orders = 3;

struct Loops {
    kernels::LevelSum* sum;
    kernels::Restrict* restrict_row;
    kernels::Prolong* prolong_row;
    kernels::Split* split;
    kernels::Join* join;
};

Loops loops_of(Simd simd) {
    switch (simd) {
#if defined(__x86_64__)
        case Simd::avx512:
            return {kernels::sum_level_avx512, kernels::restrict_avx512, kernels::prolong_avx512,
                    kernels::split_avx512, kernels::join_avx512};
        case Simd::avx2:
            return {kernels::sum_level_avx2, kernels::restrict_avx2, kernels::prolong_avx2,
                    kernels::split_avx2, kernels::join_avx2};
#endif
        default:
            return {kernels::sum_level_portable, kernels::restrict_portable,
                    kernels::prolong_portable, kernels::split_portable, kernels::join_portable};
    }
}

// r^2 for which the softened kernel has the kernel's value: C^2 at a^2, a^2/3 at 0.
double softened(double u, double a) {
    const double t = u / (a * a);
    if (t >= 1) return u;
    return a * a * (t + std::pow(1 - t, 3) / 3);
}

// a + b w + c w^2 through the values at the three Chebyshev points of [low, high].
template <class Value>
void fit(double low, double high, const Value& value, float* a, float* b, float* c) {
    const double middle = (low + high) / 2, away = (high - low) / 2 * 0.86602540378443865;
    const double below = value(middle - away), centre = value(middle), above = value(middle + away);
    const double curve = (above + below - 2 * centre) / (2 * away * away);
    const double slope = (above - below) / (2 * away);
    *c = float(curve);
    *b = float(slope - 2 * curve * middle);
    *a = float(centre - slope * middle + curve * middle * middle);
}

}  // namespace

// What nodes of one grid hold while a sum is made.
struct LevelSum::Planes {
    const LevelGrid* grid;
    int channels;
    bool is_expanded;
    Texels values;

    Planes(const LevelGrid& g, int c, bool expanded)
        : grid(&g), channels(c), is_expanded(expanded) {
        values.assign(grid->plane() * 2 * planes(), 0.0f);
    }
    [[nodiscard]] int planes() const { return channels * (is_expanded ? orders : 1); }
    void clear_sums() {
        std::fill(values.begin() + std::ptrdiff_t(planes() * grid->plane()), values.end(), 0.0f);
    }
    // Of the flux (and its moments) or the sums (and their derivatives).
    [[nodiscard]] float* plane(bool sums, int order, int c) const {
        const int per_kind = is_expanded ? orders : 1;
        const std::size_t index =
            (std::size_t(sums) * per_kind + (is_expanded ? order : 0)) * channels + c;
        return const_cast<float*>(values.data()) + index * grid->plane();
    }
};

LevelSum::LevelSum(const TransportSurface& surface, const RadialKernel& kernel, Settings settings,
                   const Executor& executor, const std::stop_token& stop, Simd simd)
    : settings_(settings), simd_(simd), channels_(kernel.channels()) {
    cut_ = std::min(kernel.range(), surface.extent() + surface.spacing()) * surface.width();
    while (settings_.ratio * std::exp2(levels_) < cut_) ++levels_;
    settings_.first_level = std::min(settings_.first_level, levels_ - 1);
    core_ = kernel.core() / kernel.spacing();
    make_grids(surface, stop);
    measure_cliffs(executor, stop);
    const double relief = surface.relief() * surface.width();
    parallel_rows(executor, levels_ - settings_.first_level, stop, [&](RowRange levels) {
        for (int l = levels.begin; l < levels.end; ++l)
            make_tables(kernel, std::size_t(l + settings_.first_level), relief);
    });
}

void LevelSum::make_grids(const TransportSurface& surface, const std::stop_token& stop) {
    const int pad = std::max(least_pad, int(std::ceil(2 * settings_.ratio)) + 1);
    LevelGrid first(surface.width(), surface.height(), 0, pad);
    for (int j = 0; j < first.height; ++j)
        for (int i = 0; i < first.width; ++i) {
            first.z[first.at(i, j)] = surface.z.at(i, j) * float(surface.width());
            first.present[std::size_t(j) * first.width + i] = surface.area.at(i, j) > 0;
        }
    level_.emplace_back(std::move(first));
    for (int l = 0; l + 1 < levels_; ++l) {
        if (stop.stop_requested()) throw Error(error_code::cancelled, "the render was cancelled");
        between_.push_back(halved(level_[l].grid, true, level_margin, pad));
        level_.emplace_back(halved(between_[l], false, level_margin, pad));
    }
    for (int l = levels_ - 1; l > 0; --l) {
        fill_gaps(between_[l - 1], level_[l].grid, false);
        fill_gaps(level_[l - 1].grid, between_[l - 1], true);
    }
    for (Level& level : level_) level.grid.extend();
    for (LevelGrid& grid : between_) grid.extend();
    for (int l = 0; l < levels_; ++l) level_[l].softening = settings_.ratio * std::exp2(l);
}

// How far heights may lie from those of nodes of level l: where its kernel is still much the same.
double LevelSum::reach_of(int l) const {
    const double reach = 0.4 * level_[l].softening;
    return l <= settings_.first_level ? std::min(reach, 0.8 * core_) : reach;
}

void LevelSum::measure_cliffs(const Executor& executor, const std::stop_token& stop) {
    constexpr double weights[] = {5, 7, 35, 105, 105, 35, 7, 5};
    for (int l = 0; l + 1 < levels_; ++l)
        for (const bool rows : {true, false}) {
            const LevelGrid& fine = rows ? level_[l].grid : between_[l];
            const LevelGrid& coarse = rows ? between_[l] : level_[l + 1].grid;
            const auto reach = float(reach_of(l + 1));
            std::vector<double> beyond(coarse.height), all(coarse.height);
            parallel_rows(executor, coarse.height, stop, [&](RowRange range) {
                for (int j = range.begin; j < range.end; ++j)
                    for (int i = 0; i < coarse.width; ++i)
                        for (int k = 0; k < 8; ++k) {
                            const int u = rows ? i : 2 * i - 3 + k, v = rows ? 2 * j - 3 + k : j;
                            if (u < 0 || v < 0 || u >= fine.width || v >= fine.height) continue;
                            const unsigned present = fine.present[std::size_t(v) * fine.width + u];
                            const float rise = fine.z[fine.at(u, v)] - coarse.z[coarse.at(i, j)];
                            all[j] += weights[k] * present;
                            beyond[j] += std::abs(rise) > reach ? weights[k] * present : 0;
                        }
            });
            double sum = 0, share = 0;
            for (int j = 0; j < coarse.height; ++j) {
                sum += all[j];
                share += beyond[j];
            }
            if (sum > 0) cliffs_ = std::max(cliffs_, share / sum);
        }
}

// The kernel of one level between nodes at every offset, as pieces over their difference in height.
void LevelSum::make_tables(const RadialKernel& kernel, std::size_t l, double relief) {
    Level& level = level_[l];
    const bool is_first = int(l) == settings_.first_level, is_last = int(l) + 1 == levels_;
    const double spacing = kernel.spacing(), node = std::exp2(double(l));
    // The last one's nodes lie around the map as well.
    const double a = level.softening;
    const double cut = std::min(kernel.range() / spacing, is_last ? cut_ + 6 * node : 2 * a);
    const double start = is_first ? std::clamp(core_ * core_ / 2, 0.1, a * a / 4) : a * a / 4;
    const auto at = [&](int c, double u) {
        return double(kernel.at_squared(c, float(u * spacing * spacing)));
    };
    const auto value = [&](int c, double u) {
        const double own = is_first ? at(c, u) : at(c, softened(u, a));
        return is_last ? own : own - at(c, softened(u, 2 * a));
    };
    const int reach = int(cut / node);
    std::map<int, std::size_t> made;  // pieces by squared offset
    for (int dy = -reach; dy <= reach; ++dy)
        for (int dx = -reach; dx <= reach; ++dx) {
            const int squared = dx * dx + dy * dy;
            const double s = squared * node * node;
            if (s >= cut * cut) continue;
            kernels::LevelOffset offset{.dx = dx, .dy = dy, .start = float(s + start)};
            const double low = s + start;
            const double high = std::min(cut * cut, s + relief * relief) + start;
            const auto piece = [&](double w, int shift) {
                return std::bit_cast<int>(float(w)) >> shift;
            };
            while (piece(high, offset.shift) - piece(low, offset.shift) > kernels::level_pieces - 2)
                ++offset.shift;
            offset.first = piece(low, offset.shift);
            const auto [place, is_new] = made.try_emplace(squared, level.pieces.size());
            if (is_new) {
                level.pieces.resize(level.pieces.size() + std::size_t(channels_) * 96, 0.0f);
                float* pieces = &level.pieces[place->second];
                for (int k = 0; k <= piece(high, offset.shift) - offset.first; ++k) {
                    const auto bound = [&](int p) {
                        return double(std::bit_cast<float>((offset.first + p) << offset.shift));
                    };
                    const double from = std::max(low, bound(k));
                    const double to = std::max(std::min(bound(k + 1), high), from * (1 + 1.0 / 64));
                    for (int c = 0; c < channels_; ++c)
                        fit(
                            from, to, [&](double w) { return value(c, std::max(w - start, 0.0)); },
                            pieces + 96 * c + k, pieces + 96 * c + 32 + k,
                            pieces + 96 * c + 64 + k);
                }
            }
            level.offsets.push_back(offset);
        }
    for (kernels::LevelOffset& offset : level.offsets)
        offset.pieces = &level.pieces[made.at(offset.dx * offset.dx + offset.dy * offset.dy)];
}

// Rows of `fine` to half as many.
void LevelSum::halve_rows(const Planes& fine, Planes& coarse, double reach,
                          const Executor& executor, const std::stop_token& stop) const {
    const LevelGrid &from = *fine.grid, &to = *coarse.grid;
    const int m = to.margin, first = -from.margin;
    parallel_rows(executor, to.height + 2 * m, stop, [&](RowRange range) {
        for (int j = range.begin - m; j < range.end - m; ++j)
            for (int c = 0; c < channels_; ++c) {
                kernels::Restriction r{.count = from.width - 2 * first, .reach = float(reach)};
                r.coarse_z = &to.z[to.at(first, j)];
                r.has_moments = fine.is_expanded;
                for (int k = 0; k < 8; ++k) {
                    const long at = from.at(first, 2 * j - 3 + k);
                    r.fine_z[k] = &from.z[at];
                    for (int o = 0; o < orders; ++o) r.from[o][k] = fine.plane(false, o, c) + at;
                }
                for (int o = 0; o < orders; ++o)
                    r.to[o] = coarse.plane(false, o, c) + to.at(first, j);
                loops_of(simd_).restrict_row(r);
            }
    });
}

// A row's even and odd numbers apart.
class LevelSum::Halves {
public:
    explicit Halves(int nodes) : size_(nodes + 2 * kernels::level_overrun), values_(8 * size_) {}
    // Of numbers 2 i and 2 i + 1 counted from the first one.
    [[nodiscard]] float* half(int row, int odd) { return values_.data() + (2 * row + odd) * size_; }

private:
    std::size_t size_;
    std::vector<float> values_;
};

// Columns of `fine` to half as many.
void LevelSum::halve_columns(const Planes& fine, Planes& coarse, double reach,
                             const Executor& executor, const std::stop_token& stop) const {
    const LevelGrid &from = *fine.grid, &to = *coarse.grid;
    const int m = to.margin, count = to.width + 2 * m;
    const int pairs = count + 3;  // from fine column 2 (-m - 2) on
    const Loops loops = loops_of(simd_);
    parallel_rows(executor, to.height + 2 * m, stop, [&](RowRange range) {
        Halves halves(pairs);
        for (int j = range.begin - m; j < range.end - m; ++j) {
            const long base = from.at(2 * (-m - 2), j), target = to.at(-m, j);
            const auto split = [&](const float* plane, int row) {
                loops.split(plane + base, pairs, halves.half(row, 0), halves.half(row, 1));
            };
            split(from.z.data(), 3);
            for (int c = 0; c < channels_; ++c) {
                kernels::Restriction r{.count = count, .reach = float(reach)};
                r.coarse_z = &to.z[target];
                r.has_moments = true;
                for (int o = 0; o < orders; ++o) {
                    split(fine.plane(false, o, c), o);
                    r.to[o] = coarse.plane(false, o, c) + target;
                }
                for (int k = 0; k < 8; ++k) {  // fine node 2 I - 3 + k
                    const int odd = k % 2 == 0, on = (k + 1) / 2;
                    r.fine_z[k] = halves.half(3, odd) + on;
                    for (int o = 0; o < orders; ++o) r.from[o][k] = halves.half(o, odd) + on;
                }
                loops.restrict_row(r);
            }
        }
    });
}

void LevelSum::refine_rows(const Planes& coarse, Planes& fine, double reach,
                           const Executor& executor, const std::stop_token& stop) const {
    const LevelGrid &from = *coarse.grid, &to = *fine.grid;
    const int m = to.margin;
    parallel_rows(executor, to.height + 2 * m, stop, [&](RowRange range) {
        for (int j = range.begin - m; j < range.end - m; ++j)
            for (int c = 0; c < channels_; ++c) {
                kernels::Prolongation p{.count = to.width + 2 * m, .reach = float(reach)};
                p.is_upper = (j & 1) != 0;
                p.has_derivatives = fine.is_expanded;
                p.fine_z = &to.z[to.at(-m, j)];
                for (int k = 0; k < 4; ++k) {
                    const long at = from.at(-m, (j >> 1) - 2 + p.is_upper + k);
                    p.coarse_z[k] = &from.z[at];
                    for (int o = 0; o < orders; ++o) p.from[o][k] = coarse.plane(true, o, c) + at;
                }
                for (int o = 0; o < orders; ++o) p.to[o] = fine.plane(true, o, c) + to.at(-m, j);
                loops_of(simd_).prolong_row(p);
            }
    });
}

void LevelSum::refine_columns(const Planes& coarse, Planes& fine, double reach,
                              const Executor& executor, const std::stop_token& stop) const {
    const LevelGrid &from = *coarse.grid, &to = *fine.grid;
    const int m = to.margin, first = -((m + 1) / 2);
    const int pairs = (to.width + m + 1) / 2 - first;
    const Loops loops = loops_of(simd_);
    parallel_rows(executor, to.height + 2 * m, stop, [&](RowRange range) {
        Halves halves(pairs);
        for (int j = range.begin - m; j < range.end - m; ++j) {
            const long target = to.at(2 * first, j);
            loops.split(&to.z[target], pairs, halves.half(3, 0), halves.half(3, 1));
            for (int c = 0; c < channels_; ++c) {
                for (int upper = 0; upper < 2; ++upper) {
                    kernels::Prolongation p{.count = pairs, .reach = float(reach)};
                    p.is_upper = upper != 0;
                    p.has_derivatives = true;
                    p.fine_z = halves.half(3, upper);
                    for (int k = 0; k < 4; ++k) {
                        const long at = from.at(first - 2 + upper + k, j);
                        p.coarse_z[k] = &from.z[at];
                        for (int o = 0; o < orders; ++o)
                            p.from[o][k] = coarse.plane(true, o, c) + at;
                    }
                    for (int o = 0; o < orders; ++o) p.to[o] = halves.half(o, upper);
                    loops.prolong_row(p);
                }
                for (int o = 0; o < orders; ++o)
                    loops.join(halves.half(o, 0), halves.half(o, 1), pairs,
                               fine.plane(true, o, c) + target);
            }
        }
    });
}

void LevelSum::sum_level(std::size_t l, Planes& planes, const Executor& executor,
                         const std::stop_token& stop) const {
    const Level& level = level_[l];
    const LevelGrid& grid = level.grid;
    const int m = grid.margin;
    parallel_rows(executor, grid.height + 2 * m, stop, [&](RowRange range) {
        for (int j = range.begin - m; j < range.end - m; ++j) {
            kernels::LevelRows rows;
            rows.z = grid.z.data() + grid.at(-m, j);
            rows.pitch = grid.pitch;
            rows.columns = grid.width + 2 * m;
            for (int o = 0; o < (planes.is_expanded ? orders : 1); ++o)
                for (int c = 0; c < channels_; ++c) {
                    rows.sources[o][c] = planes.plane(false, o, c) + grid.at(-m, j);
                    rows.sums[o][c] = planes.plane(true, o, c) + grid.at(-m, j);
                }
            // Offsets go by rows: those that lead beyond the nodes are at either end.
            const auto begin =
                std::partition_point(level.offsets.begin(), level.offsets.end(),
                                     [&](const kernels::LevelOffset& o) { return o.dy < -m - j; });
            const auto end = std::partition_point(
                begin, level.offsets.end(),
                [&](const kernels::LevelOffset& o) { return j + o.dy < grid.height + m; });
            loops_of(simd_).sum(rows, level.offsets.data() + (begin - level.offsets.begin()),
                                int(end - begin), channels_, planes.is_expanded);
        }
    });
}

// Planes of all grids, kept from sum to sum: what they hold beyond their nodes stays 0.
struct LevelSum::Workspace {
    std::vector<Planes> levels, between;
    explicit Workspace(const LevelSum& sum) {
        for (int l = 0; l < sum.levels_; ++l)
            levels.emplace_back(sum.level_[l].grid, sum.channels_, l > 0);
        for (const LevelGrid& grid : sum.between_) between.emplace_back(grid, sum.channels_, true);
    }
};

LevelSum::~LevelSum() = default;

std::unique_ptr<LevelSum::Workspace> LevelSum::take_workspace() const {
    const std::scoped_lock lock(mutex_);
    return spare_ ? std::move(spare_) : std::make_unique<Workspace>(*this);
}

Image LevelSum::sum(const Image& flux, const Executor& executor,
                    const std::stop_token& stop) const {
    std::unique_ptr<Workspace> workspace = take_workspace();
    std::vector<Planes>&levels = workspace->levels, &between = workspace->between;
    levels.back().clear_sums();
    const LevelGrid& texels = level_[0].grid;
    parallel_rows(executor, flux.height, stop, [&](RowRange rows) {
        for (int j = rows.begin; j < rows.end; ++j)
            for (int i = 0; i < flux.width; ++i) {
                if (texels.present[std::size_t(j) * flux.width + i] == 0) continue;
                for (int c = 0; c < channels_; ++c)
                    levels[0].plane(false, 0, c)[texels.at(i, j)] = flux.at(i, j, c);
            }
    });
    for (int l = 0; l + 1 < levels_; ++l) {
        halve_rows(levels[l], between[l], reach_of(l + 1), executor, stop);
        halve_columns(between[l], levels[l + 1], reach_of(l + 1), executor, stop);
    }
    for (int l = levels_ - 1; l >= 0; --l) {
        if (l >= settings_.first_level) sum_level(std::size_t(l), levels[l], executor, stop);
        if (l == 0) break;
        refine_columns(levels[l], between[l - 1], reach_of(l), executor, stop);
        refine_rows(between[l - 1], levels[l - 1], reach_of(l), executor, stop);
    }
    Image out(flux.width, flux.height, channels_);
    parallel_rows(executor, flux.height, stop, [&](RowRange rows) {
        for (int j = rows.begin; j < rows.end; ++j)
            for (int i = 0; i < flux.width; ++i) {
                if (texels.present[std::size_t(j) * flux.width + i] == 0) continue;
                for (int c = 0; c < channels_; ++c)
                    out.at(i, j, c) = levels[0].plane(true, 0, c)[texels.at(i, j)];
            }
    });
    const std::scoped_lock lock(mutex_);
    spare_ = std::move(workspace);
    return out;
}

std::uint64_t LevelSum::bytes() const {
    std::uint64_t sum = 0;
    const auto of_grid = [](const LevelGrid& grid) {
        return (grid.z.size() + grid.present.size()) * sizeof(float);
    };
    for (const Level& level : level_)
        sum += of_grid(level.grid) + level.pieces.size() * sizeof(float) +
               level.offsets.size() * sizeof(kernels::LevelOffset);
    for (const LevelGrid& grid : between_) sum += of_grid(grid);
    return sum;
}

}  // namespace relit
