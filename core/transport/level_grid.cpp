#include "core/transport/level_grid.h"

#include <algorithm>
#include <cmath>

#include "core/base/error.h"

namespace relit {

LevelGrid::LevelGrid(int w, int h, int margin_nodes, int pad_nodes)
    : width(w), height(h), margin(margin_nodes), pad(pad_nodes) {
    // An odd number of cache lines: columns of a power of two would share the same few sets.
    pitch = (w + 2 * pad + kernels::level_overrun + 15) / 16 * 16;
    if (pitch / 16 % 2 == 0) pitch += 16;
    z.assign(plane(), 0.0f);
    present.assign(std::size_t(w) * h, 0);
}

void LevelGrid::extend() {
    for (int j = -pad; j < height + pad; ++j) {
        float* row = &z[at(0, j)];
        if (j < 0 || j >= height) std::copy_n(&z[at(0, std::clamp(j, 0, height - 1))], width, row);
        std::fill(row - pad, row, row[0]);
        std::fill(row + width, row - pad + pitch, row[width - 1]);
    }
}

namespace {

// Half as many columns or rows as `fine`: nodes lie between two of it, at their mean height.
LevelGrid halved(const LevelGrid& fine, bool rows, int margin, int pad) {
    const int across = rows ? 1 : 2, down = rows ? 2 : 1;
    LevelGrid coarse((fine.width + across - 1) / across, (fine.height + down - 1) / down, margin,
                     pad);
    for (int j = 0; j < coarse.height; ++j)
        for (int i = 0; i < coarse.width; ++i) {
            double sum = 0;
            unsigned count = 0;
            for (int v = j * down; v < std::min((j + 1) * down, fine.height); ++v)
                for (int u = i * across; u < std::min((i + 1) * across, fine.width); ++u) {
                    const unsigned present = fine.present[std::size_t(v) * fine.width + u];
                    sum += present * double(fine.z[fine.at(u, v)]);
                    count += present;
                }
            coarse.z[coarse.at(i, j)] = count > 0 ? float(sum / count) : 0.0f;
            coarse.present[std::size_t(j) * coarse.width + i] = count;
        }
    return coarse;
}

// Gives nodes of `fine` where nothing is the height of the one of `coarse` that stands for them.
void fill_gaps(LevelGrid& fine, const LevelGrid& coarse, bool rows) {
    for (int j = 0; j < fine.height; ++j)
        for (int i = 0; i < fine.width; ++i)
            if (fine.present[std::size_t(j) * fine.width + i] == 0)
                fine.z[fine.at(i, j)] = coarse.z[coarse.at(rows ? i : i / 2, rows ? j / 2 : j)];
}

// Gives nodes of the last grid where nothing is the mean height of the others.
void fill_with_mean(LevelGrid& grid) {
    double sum = 0, count = 0;
    for (int j = 0; j < grid.height; ++j)
        for (int i = 0; i < grid.width; ++i) {
            const double present = grid.present[std::size_t(j) * grid.width + i];
            sum += present * grid.z[grid.at(i, j)];
            count += present;
        }
    for (int j = 0; j < grid.height; ++j)
        for (int i = 0; i < grid.width; ++i)
            if (count > 0 && grid.present[std::size_t(j) * grid.width + i] == 0)
                grid.z[grid.at(i, j)] = float(sum / count);
}

// Rows' columns where something is, and as far around as cubics of any level reach.
std::vector<LevelSheet::Columns> active_columns(const LevelGrid& grid) {
    std::vector<LevelSheet::Columns> of_rows(grid.height);
    for (int j = 0; j < grid.height; ++j) {
        const auto begin = grid.present.begin() + std::ptrdiff_t(j) * grid.width;
        const auto is_present = [](unsigned count) { return count > 0; };
        const auto first = std::find_if(begin, begin + grid.width, is_present);
        if (first == begin + grid.width) continue;
        auto last = begin + grid.width - 1;
        while (!is_present(*last)) --last;
        of_rows[j] = {int(first - begin), int(last - begin)};
    }
    std::vector<LevelSheet::Columns> active(grid.height + 2 * grid.margin);
    for (int j = -grid.margin; j < grid.height + grid.margin; ++j) {
        LevelSheet::Columns columns{grid.width + grid.margin, -1 - grid.margin};
        for (int v = std::max(j - grid.margin, 0); v <= std::min(j + grid.margin, grid.height - 1);
             ++v) {
            if (of_rows[v].first > of_rows[v].last) continue;
            columns.first = std::min(columns.first, of_rows[v].first - grid.margin);
            columns.last = std::max(columns.last, of_rows[v].last + grid.margin);
        }
        active[j + grid.margin] = columns;
    }
    return active;
}

}  // namespace

LevelSheet level_sheet(const TransportSurface& surface, float low, float high, int levels, int pad,
                       const std::stop_token& stop) {
    LevelSheet sheet;
    LevelGrid first(surface.width(), surface.height(), 0, pad);
    for (int j = 0; j < first.height; ++j)
        for (int i = 0; i < first.width; ++i) {
            const float z = surface.z.at(i, j);
            first.z[first.at(i, j)] = z * float(surface.width());
            first.present[std::size_t(j) * first.width + i] =
                surface.area.at(i, j) > 0 && z >= low && z < high;
        }
    sheet.levels.push_back(std::move(first));
    for (int l = 0; l + 1 < levels; ++l) {
        if (stop.stop_requested()) throw Error(error_code::cancelled, "the render was cancelled");
        sheet.between.push_back(halved(sheet.levels[l], true, level_margin, pad));
        sheet.levels.push_back(halved(sheet.between[l], false, level_margin, pad));
    }
    fill_with_mean(sheet.levels.back());
    for (int l = levels - 1; l > 0; --l) {
        fill_gaps(sheet.between[l - 1], sheet.levels[l], false);
        fill_gaps(sheet.levels[l - 1], sheet.between[l - 1], true);
    }
    for (LevelGrid& grid : sheet.levels) {
        grid.extend();
        sheet.active_of_rows.push_back(active_columns(grid));
    }
    for (LevelGrid& grid : sheet.between) grid.extend();
    return sheet;
}

std::vector<float> cliff_heights(const TransportSurface& surface, int count) {
    constexpr int bins = 256;
    constexpr float steep = 2;  // texels from one to the next
    float low = INFINITY, high = -INFINITY;
    for (std::size_t k = 0; k < surface.z.values.size(); ++k)
        if (surface.area.values[k] > 0) {
            low = std::min(low, surface.z.values[k]);
            high = std::max(high, surface.z.values[k]);
        }
    std::vector<float> heights;
    const auto bin_of = [&](float z) { return int((z - low) / (high - low) * (bins - 1)); };
    while (int(heights.size()) < count && low < high) {
        std::vector<double> begun(bins +
                                  1);  // weight of cliffs that begin less that of those that end
        const auto look_at = [&](int i, int j, int u, int v) {
            if (u >= surface.width() || v >= surface.height()) return;
            if (!(surface.area.at(i, j) > 0) || !(surface.area.at(u, v) > 0)) return;
            const auto [foot, top] = std::minmax({surface.z.at(i, j), surface.z.at(u, v)});
            const float steps = (top - foot) * float(surface.width());
            if (steps < steep) return;
            for (const float height : heights)
                if (foot < height && top >= height) return;
            begun[bin_of(foot) + 1] += steps;
            begun[bin_of(top) + 1] -= steps;
        };
        for (int j = 0; j < surface.height(); ++j)
            for (int i = 0; i < surface.width(); ++i) {
                look_at(i, j, i + 1, j);
                look_at(i, j, i, j + 1);
            }
        double weight = 0, most = 0;
        int first = 0, last = 0;  // of the heights that the most weight crosses
        for (int k = 0; k < bins; ++k) {
            weight += begun[k];
            if (weight > most * (1 + 1e-6)) {
                most = weight;
                first = k;
            }
            if (weight > most * (1 - 1e-6)) last = k;
        }
        if (most <= 0) break;
        heights.push_back(low + (high - low) * (float(first + last) / 2) / (bins - 1));
    }
    std::sort(heights.begin(), heights.end());
    return heights;
}

Carried carried_between(const LevelGrid& fine, const LevelGrid& coarse, bool rows, double reach,
                        const Executor& executor, const std::stop_token& stop) {
    constexpr double weights[] = {5, 7, 35, 105, 105, 35, 7, 5};
    std::vector<Carried> of_rows(coarse.height);
    parallel_rows(executor, coarse.height, stop, [&](RowRange range) {
        for (int j = range.begin; j < range.end; ++j)
            for (int i = 0; i < coarse.width; ++i)
                for (int k = 0; k < 8; ++k) {
                    const int u = rows ? i : 2 * i - 3 + k, v = rows ? 2 * j - 3 + k : j;
                    if (u < 0 || v < 0 || u >= fine.width || v >= fine.height) continue;
                    const double weight =
                        weights[k] * fine.present[std::size_t(v) * fine.width + u];
                    const float rise = fine.z[fine.at(u, v)] - coarse.z[coarse.at(i, j)];
                    of_rows[j].all += weight;
                    if (std::abs(rise) > reach) of_rows[j].beyond += weight;
                }
    });
    Carried sum;
    for (const Carried& row : of_rows) {
        sum.all += row.all;
        sum.beyond += row.beyond;
    }
    return sum;
}

}  // namespace relit
