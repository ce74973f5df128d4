#include "core/transport/convolution.h"

#include <kissfft/kiss_fft.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <complex>
#include <memory>
#include <new>

namespace relit {
namespace {

using Complex = std::complex<float>;
static_assert(sizeof(Complex) == sizeof(kiss_fft_cpx));
static_assert(std::is_same_v<kiss_fft_scalar, float>);

// What threads share is read only: the library writes to its output alone.
class Transform {
public:
    Transform(int size, bool inverse)
        : state_(kiss_fft_alloc(size, inverse ? 1 : 0, nullptr, nullptr)) {
        if (!state_) throw std::bad_alloc();
    }
    void operator()(const Complex* from, Complex* to) const {
        kiss_fft(state_.get(), reinterpret_cast<const kiss_fft_cpx*>(from),
                 reinterpret_cast<kiss_fft_cpx*>(to));
    }

private:
    struct Free {
        void operator()(kiss_fft_cfg state) const { kiss_fft_free(state); }
    };
    std::unique_ptr<kiss_fft_state, Free> state_;
};

// Rows that are transformed together: a cache line of each column.
constexpr int row_block = 8;

// Spectra of the rows of a real map that is 0 beyond `rows`: [column 0..width / 2][row].
class RowSpectra {
public:
    RowSpectra(int width, int height)
        : width_(width), height_(height), values_(std::size_t(columns()) * height * 2) {}

    [[nodiscard]] int columns() const { return width_ / 2 + 1; }
    [[nodiscard]] Complex* column(int k) {
        return reinterpret_cast<Complex*>(values_.data()) + std::size_t(k) * height_;
    }

    // Two real rows are one complex transform. `fill(row, numbers)` sets a row's first numbers, which
    // are `step` floats apart; the rest is 0.
    template <class Fill>
    void from_rows(int rows, const Fill& fill, const Executor& executor,
                   const std::stop_token& stop) {
        const Transform transform(width_, false);
        parallel_rows(executor, (rows + row_block - 1) / row_block, stop, [&](RowRange blocks) {
            std::vector<Complex> pair(width_), spectrum(width_);
            const int last = std::min(blocks.end * row_block, rows);
            for (int row = blocks.begin * row_block; row < last; row += 2) {
                std::fill(pair.begin(), pair.end(), Complex{});
                float* numbers = reinterpret_cast<float*>(pair.data());
                fill(row, numbers);
                if (row + 1 < rows) fill(row + 1, numbers + 1);
                transform(pair.data(), spectrum.data());
                for (int k = 0; k < columns(); ++k) {
                    const Complex a = spectrum[k], b = std::conj(spectrum[k > 0 ? width_ - k : 0]);
                    const Complex sum = a + b, difference = a - b;
                    column(k)[row] = {sum.real() / 2, sum.imag() / 2};
                    if (row + 1 < height_)
                        column(k)[row + 1] = {difference.imag() / 2, -difference.real() / 2};
                }
            }
        });
    }

    // The first `rows` rows back: `take(row, numbers)`, numbers 2 floats apart.
    template <class Take>
    void to_rows(int rows, const Take& take, const Executor& executor,
                 const std::stop_token& stop) {
        const Transform transform(width_, true);
        parallel_rows(executor, (rows + row_block - 1) / row_block, stop, [&](RowRange blocks) {
            std::vector<Complex> pair(width_), spectrum(width_);
            const int last = std::min(blocks.end * row_block, rows);
            for (int row = blocks.begin * row_block; row < last; row += 2) {
                const bool has_second = row + 1 < rows;
                for (int k = 0; k < columns(); ++k) {
                    const Complex a = column(k)[row];
                    const Complex b = has_second ? column(k)[row + 1] : Complex{};
                    spectrum[k] = {a.real() - b.imag(), a.imag() + b.real()};
                    if (k > 0) spectrum[width_ - k] = {a.real() + b.imag(), b.real() - a.imag()};
                }
                transform(spectrum.data(), pair.data());
                const float* numbers = reinterpret_cast<const float*>(pair.data());
                take(row, numbers);
                if (has_second) take(row + 1, numbers + 1);
            }
        });
    }

private:
    int width_, height_;
    Texels values_;
};

// A quarter of the kernel: of the cells dx, dy >= 0 apart.
struct Quarter {
    int columns, rows;
    std::vector<float> values;

    Quarter(const RadialKernel& kernel, int c, int across, int down) : columns(across), rows(down) {
        const double h = kernel.spacing(), radius = kernel.short_range() / h;
        const auto at = [&](int dx, int dy) {
            const double squared = double(dx) * dx + double(dy) * dy;
            return squared <= radius * radius ? kernel.at_squared(c, float(squared * h * h)) : 0.0f;
        };
        for (int dy = 0; dy < rows; ++dy)
            for (int dx = 0; dx < columns; ++dx) values.push_back(at(dx, dy));
    }
};

}  // namespace

int transform_size(int n) {
    assert(n >= 1);
    for (int size = n + n % 2;; size += 2) {
        int rest = size;
        for (const int prime : {2, 3, 5})
            while (rest % prime == 0) rest /= prime;
        if (rest == 1) return size;
    }
}

KernelSpectrum::KernelSpectrum(const RadialKernel& kernel, int width, int height,
                               const Executor& executor, const std::stop_token& stop)
    : channels_(kernel.channels()) {
    const auto radius = int(std::min(kernel.short_range() / kernel.spacing(), 1e9));
    const int across = std::min(radius, width - 1) + 1, down = std::min(radius, height - 1) + 1;
    padded_width_ = transform_size(width + across - 1);
    padded_height_ = transform_size(height + down - 1);
    const int columns = padded_width_ / 2 + 1;
    values_.resize(std::size_t(channels_) * columns * padded_height_);
    const Transform transform(padded_height_, false);
    RowSpectra spectra(padded_width_, padded_height_);
    for (int c = 0; c < channels_; ++c) {
        const Quarter quarter(kernel, c, across, down);
        const auto fill = [&](int row, float* numbers) {
            const int dy = std::min(row, padded_height_ - row);
            if (dy >= down) return;
            const float* values = &quarter.values[std::size_t(dy) * across];
            numbers[0] = values[0];
            for (int dx = 1; dx < across; ++dx)
                numbers[2 * dx] = numbers[2 * (padded_width_ - dx)] = values[dx];
        };
        spectra.from_rows(padded_height_, fill, executor, stop);
        float* of_channel = values_.data() + std::size_t(c) * columns * padded_height_;
        parallel_rows(executor, columns, stop, [&](RowRange range) {
            std::vector<Complex> spectrum(padded_height_);
            for (int k = range.begin; k < range.end; ++k) {
                transform(spectra.column(k), spectrum.data());
                for (int row = 0; row < padded_height_; ++row)
                    of_channel[std::size_t(k) * padded_height_ + row] = spectrum[row].real();
            }
        });
    }
}

Image convolved(const KernelSpectrum& spectrum, const Image& flux, const Executor& executor,
                const std::stop_token& stop) {
    const int width = spectrum.padded_width(), height = spectrum.padded_height();
    const int channels = spectrum.channels();
    assert(flux.channels == channels && flux.width <= width && flux.height <= height);
    const Transform forward(height, false), inverse(height, true);
    const float scale = 1 / (float(width) * float(height));
    RowSpectra spectra(width, height);
    Image out(flux.width, flux.height, channels);
    for (int c = 0; c < channels; ++c) {
        const auto fill = [&](int row, float* numbers) {
            const float* from = flux.row(row).data() + c;
            for (int i = 0; i < flux.width; ++i) numbers[2 * i] = from[i * channels];
        };
        spectra.from_rows(flux.height, fill, executor, stop);
        parallel_rows(executor, spectra.columns(), stop, [&](RowRange range) {
            std::vector<Complex> numbers(height);
            for (int k = range.begin; k < range.end; ++k) {
                Complex* column = spectra.column(k);
                const float* factors = spectrum.of_channel(c) + std::size_t(k) * height;
                std::fill(column + flux.height, column + height, Complex{});
                forward(column, numbers.data());
                for (int row = 0; row < height; ++row) numbers[row] *= factors[row];
                inverse(numbers.data(), column);
            }
        });
        const auto take = [&](int row, const float* numbers) {
            float* to = out.row(row).data() + c;
            for (int i = 0; i < flux.width; ++i) to[i * channels] = scale * numbers[2 * i];
        };
        spectra.to_rows(flux.height, take, executor, stop);
    }
    return out;
}

}  // namespace relit
