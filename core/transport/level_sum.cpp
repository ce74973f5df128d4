#include "core/transport/level_sum.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>

#include "core/base/error.h"

namespace relit {
namespace {

constexpr int least_pad = 12;  // that flux is carried from: 8 nodes around twice the margin
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

}  // namespace

// What the nodes of one grid hold while a sum is made: of sources flux and moments, of sums values and
// derivatives; of texels the first of them only.
struct LevelSum::Planes {
    std::size_t size;  // of a plane
    int channels;
    bool is_expanded;
    Texels values;

    Planes(const LevelGrid& grid, int c, bool expanded)
        : size(grid.plane()), channels(c), is_expanded(expanded) {
        values.assign(size * channels * (expanded ? orders : 1), 0.0f);
    }
    void clear() { std::fill(values.begin(), values.end(), 0.0f); }
    [[nodiscard]] float* plane(int order, int c) {
        return values.data() + (std::size_t(is_expanded ? order : 0) * channels + c) * size;
    }
    [[nodiscard]] const float* plane(int order, int c) const {
        return const_cast<Planes*>(this)->plane(order, c);
    }
};

LevelSum::LevelSum(const TransportSurface& surface, const RadialKernel& kernel, Settings settings,
                   const Executor& executor, const std::stop_token& stop, Simd simd)
    : settings_(settings), simd_(simd), channels_(kernel.channels()) {
    cut_ = std::min(kernel.range(), surface.extent() + surface.spacing()) * surface.width();
    while (settings_.ratio * std::exp2(levels_) < cut_) ++levels_;
    settings_.first_level = std::min(settings_.first_level, levels_ - 1);
    core_ = kernel.core() / kernel.spacing();
    const int pad = std::max(least_pad, int(std::ceil(2 * settings_.ratio)) + 1);
    const std::vector<float> heights = cliff_heights(surface, settings_.sheets - 1);
    for (std::size_t k = 0; k <= heights.size(); ++k)
        sheets_.push_back(level_sheet(surface, k > 0 ? heights[k - 1] : -INFINITY,
                                      k < heights.size() ? heights[k] : INFINITY, levels_, pad,
                                      stop));
    measure_cliffs(executor, stop);
    const double relief = surface.relief() * surface.width();
    kernels_.resize(levels_);
    parallel_rows(executor, levels_ - settings_.first_level, stop, [&](RowRange levels) {
        for (int k = levels.begin; k < levels.end; ++k) {
            const int l = k + settings_.first_level;
            kernels_[l] = level_kernel(kernel, {.level = l,
                                                .softening = softening_of(l),
                                                .is_first = k == 0,
                                                .is_last = l + 1 == levels_,
                                                .extent = cut_,
                                                .relief = relief});
        }
    });
}

// How far heights may lie from those of nodes of level l: where its kernel is still much the same.
double LevelSum::reach_of(int l) const {
    const double reach = 0.4 * softening_of(l);
    return l <= settings_.first_level ? std::min(reach, 0.8 * core_) : reach;
}

void LevelSum::measure_cliffs(const Executor& executor, const std::stop_token& stop) {
    for (int l = 0; l + 1 < levels_; ++l)
        for (const bool rows : {true, false}) {
            Carried carried;
            for (const LevelSheet& sheet : sheets_) {
                const LevelGrid& fine = rows ? sheet.levels[l] : sheet.between[l];
                const LevelGrid& coarse = rows ? sheet.between[l] : sheet.levels[l + 1];
                const Carried of_sheet =
                    carried_between(fine, coarse, rows, reach_of(l + 1), executor, stop);
                carried.all += of_sheet.all;
                carried.beyond += of_sheet.beyond;
            }
            if (carried.all > 0) cliffs_ = std::max(cliffs_, carried.beyond / carried.all);
        }
}

// Rows of `fine` to half as many.
void LevelSum::halve_rows(const Planes& fine, const LevelGrid& from, Planes& coarse,
                          const LevelGrid& to, double reach, const Executor& executor,
                          const std::stop_token& stop) const {
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
                    for (int o = 0; o < orders; ++o) r.from[o][k] = fine.plane(o, c) + at;
                }
                for (int o = 0; o < orders; ++o) r.to[o] = coarse.plane(o, c) + to.at(first, j);
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
void LevelSum::halve_columns(const Planes& fine, const LevelGrid& from, Planes& coarse,
                             const LevelGrid& to, double reach, const Executor& executor,
                             const std::stop_token& stop) const {
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
                    split(fine.plane(o, c), o);
                    r.to[o] = coarse.plane(o, c) + target;
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

void LevelSum::refine_rows(const Planes& coarse, const LevelGrid& from, Planes& fine,
                           const LevelGrid& to, double reach, const Executor& executor,
                           const std::stop_token& stop) const {
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
                    for (int o = 0; o < orders; ++o) p.from[o][k] = coarse.plane(o, c) + at;
                }
                for (int o = 0; o < orders; ++o) p.to[o] = fine.plane(o, c) + to.at(-m, j);
                loops_of(simd_).prolong_row(p);
            }
    });
}

void LevelSum::refine_columns(const Planes& coarse, const LevelGrid& from, Planes& fine,
                              const LevelGrid& to, double reach, const Executor& executor,
                              const std::stop_token& stop) const {
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
                        for (int o = 0; o < orders; ++o) p.from[o][k] = coarse.plane(o, c) + at;
                    }
                    for (int o = 0; o < orders; ++o) p.to[o] = halves.half(o, upper);
                    loops.prolong_row(p);
                }
                for (int o = 0; o < orders; ++o)
                    loops.join(halves.half(o, 0), halves.half(o, 1), pairs,
                               fine.plane(o, c) + target);
            }
        }
    });
}

// Adds what the nodes of one sheet give those of another, or their own.
void LevelSum::sum_level(int l, const Planes& sources, const LevelSheet& from, Planes& sums,
                         const LevelSheet& to, const Executor& executor,
                         const std::stop_token& stop) const {
    const LevelGrid& grid = to.levels[l];
    const std::vector<kernels::LevelOffset>& offsets = kernels_[l].offsets;
    const int m = grid.margin, reach = offsets.back().dy;
    parallel_rows(executor, grid.height + 2 * m, stop, [&](RowRange range) {
        for (int j = range.begin - m; j < range.end - m; ++j)
            for (int dy = std::max(-reach, -m - j); dy <= std::min(reach, grid.height + m - 1 - j);
                 ++dy) {
                const LevelSheet::Columns at = to.active(l, j), of = from.active(l, j + dy);
                const int first = std::max(at.first, of.first - reach);
                const int last = std::min(at.last, of.last + reach);
                if (first > last) continue;
                kernels::LevelRows rows;
                rows.z = &grid.z[grid.at(first, j)];
                rows.source_z = &from.levels[l].z[grid.at(first, j)];
                rows.pitch = grid.pitch;
                rows.columns = last - first + 1;
                for (int o = 0; o < (sums.is_expanded ? orders : 1); ++o)
                    for (int c = 0; c < channels_; ++c) {
                        rows.sources[o][c] = sources.plane(o, c) + grid.at(first, j);
                        rows.sums[o][c] = sums.plane(o, c) + grid.at(first, j);
                    }
                const auto begin =
                    std::partition_point(offsets.begin(), offsets.end(),
                                         [&](const kernels::LevelOffset& o) { return o.dy < dy; });
                const auto end =
                    std::partition_point(begin, offsets.end(),
                                         [&](const kernels::LevelOffset& o) { return o.dy == dy; });
                loops_of(simd_).sum(rows, &*begin, int(end - begin), channels_, sums.is_expanded);
            }
    });
}

// Planes of all grids, kept from sum to sum: what those of sources hold beyond their nodes stays 0.
// Sheets have grids of one size, and are summed for one after the other.
struct LevelSum::Workspace {
    std::vector<std::vector<Planes>> sources;  // [sheet][level]
    std::vector<Planes> sums, sources_between, sums_between;
    explicit Workspace(const LevelSum& sum) {
        const auto planes_of = [&](const std::vector<LevelGrid>& grids, bool has_texels) {
            std::vector<Planes> planes;
            planes.reserve(grids.size());
            for (const LevelGrid& grid : grids)
                planes.emplace_back(grid, sum.channels_, !has_texels || &grid != &grids[0]);
            return planes;
        };
        const LevelSheet& first = sum.sheets_[0];
        for (const LevelSheet& sheet : sum.sheets_)
            sources.push_back(planes_of(sheet.levels, true));
        sums = planes_of(first.levels, true);
        sources_between = planes_of(first.between, false);
        sums_between = planes_of(first.between, false);
    }
};

LevelSum::~LevelSum() = default;

std::unique_ptr<LevelSum::Workspace> LevelSum::take_workspace() const {
    const std::scoped_lock lock(mutex_);
    return spare_ ? std::move(spare_) : std::make_unique<Workspace>(*this);
}

void LevelSum::set_flux(const LevelGrid& texels, const Image& flux, Planes& planes,
                        const Executor& executor, const std::stop_token& stop) const {
    parallel_rows(executor, flux.height, stop, [&](RowRange rows) {
        for (int j = rows.begin; j < rows.end; ++j)
            for (int i = 0; i < flux.width; ++i) {
                if (texels.present[std::size_t(j) * flux.width + i] == 0) continue;
                for (int c = 0; c < channels_; ++c)
                    planes.plane(0, c)[texels.at(i, j)] = flux.at(i, j, c);
            }
    });
}

void LevelSum::take_sums(const LevelGrid& texels, const Planes& planes, Image& out,
                         const Executor& executor, const std::stop_token& stop) const {
    parallel_rows(executor, out.height, stop, [&](RowRange rows) {
        for (int j = rows.begin; j < rows.end; ++j)
            for (int i = 0; i < out.width; ++i) {
                if (texels.present[std::size_t(j) * out.width + i] == 0) continue;
                for (int c = 0; c < channels_; ++c)
                    out.at(i, j, c) = planes.plane(0, c)[texels.at(i, j)];
            }
    });
}

Image LevelSum::sum(const Image& flux, const Executor& executor,
                    const std::stop_token& stop) const {
    std::unique_ptr<Workspace> workspace = take_workspace();
    Workspace& planes = *workspace;
    for (std::size_t k = 0; k < sheets_.size(); ++k) {
        const LevelSheet& sheet = sheets_[k];
        std::vector<Planes>& sources = planes.sources[k];
        set_flux(sheet.levels[0], flux, sources[0], executor, stop);
        for (int l = 0; l + 1 < levels_; ++l) {
            halve_rows(sources[l], sheet.levels[l], planes.sources_between[l], sheet.between[l],
                       reach_of(l + 1), executor, stop);
            halve_columns(planes.sources_between[l], sheet.between[l], sources[l + 1],
                          sheet.levels[l + 1], reach_of(l + 1), executor, stop);
        }
    }
    Image out(flux.width, flux.height, channels_);
    for (const LevelSheet& sheet : sheets_) {
        planes.sums.back().clear();
        for (int l = levels_ - 1; l >= 0; --l) {
            for (std::size_t from = 0; from < sheets_.size() && l >= settings_.first_level; ++from)
                sum_level(l, planes.sources[from][l], sheets_[from], planes.sums[l], sheet,
                          executor, stop);
            if (l == 0) break;
            refine_columns(planes.sums[l], sheet.levels[l], planes.sums_between[l - 1],
                           sheet.between[l - 1], reach_of(l), executor, stop);
            refine_rows(planes.sums_between[l - 1], sheet.between[l - 1], planes.sums[l - 1],
                        sheet.levels[l - 1], reach_of(l), executor, stop);
        }
        take_sums(sheet.levels[0], planes.sums[0], out, executor, stop);
    }
    const std::scoped_lock lock(mutex_);
    spare_ = std::move(workspace);
    return out;
}

std::uint64_t LevelSum::bytes() const {
    std::uint64_t sum = 0;
    for (const LevelKernel& kernel : kernels_)
        sum += kernel.pieces.size() * sizeof(float) +
               kernel.offsets.size() * sizeof(kernels::LevelOffset);
    // A workspace: sources of every sheet, sums, and both between levels.
    const std::uint64_t sheets = sheets_.size();
    std::uint64_t planes = 0;
    for (const LevelSheet& sheet : sheets_)
        for (const std::vector<LevelGrid>* grids : {&sheet.levels, &sheet.between})
            for (const LevelGrid& grid : *grids)
                sum += (grid.z.size() + grid.present.size()) * sizeof(float);
    for (const LevelGrid& grid : sheets_[0].levels) {
        const bool has_texels = &grid == &sheets_[0].levels[0];
        planes += (sheets + 1) * grid.plane() * channels_ * (has_texels ? 1 : orders);
    }
    for (const LevelGrid& grid : sheets_[0].between)
        planes += 2 * grid.plane() * channels_ * orders;
    return sum + planes * sizeof(float);
}

}  // namespace relit
