#include "core/transport/level_grid.h"

#include <algorithm>

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

void fill_gaps(LevelGrid& fine, const LevelGrid& coarse, bool rows) {
    for (int j = 0; j < fine.height; ++j)
        for (int i = 0; i < fine.width; ++i)
            if (fine.present[std::size_t(j) * fine.width + i] == 0)
                fine.z[fine.at(i, j)] = coarse.z[coarse.at(rows ? i : i / 2, rows ? j / 2 : j)];
}

}  // namespace relit
