#include "core/io/tiff_float64.h"

#include <algorithm>
#include <cstdio>
#include <cstring>

#include <tiffio.h>

#include "core/io/header.h"

namespace relit {

struct Float64Tiff::Source {
    std::string_view bytes;
    std::uint64_t at = 0;
};

namespace {

using Source = Float64Tiff::Source;

tmsize_t read(thandle_t handle, void* out, tmsize_t size) {
    auto& source = *static_cast<Source*>(handle);
    const std::uint64_t left =
        source.bytes.size() - std::min<std::uint64_t>(source.at, source.bytes.size());
    const auto taken = std::size_t(std::min<std::uint64_t>(left, std::uint64_t(size)));
    if (taken > 0) std::memcpy(out, source.bytes.data() + source.at, taken);
    source.at += taken;
    return tmsize_t(taken);
}

tmsize_t write(thandle_t, void*, tmsize_t) { return 0; }

toff_t seek(thandle_t handle, toff_t offset, int whence) {
    auto& source = *static_cast<Source*>(handle);
    if (whence == SEEK_SET) source.at = offset;
    if (whence == SEEK_CUR) source.at += offset;
    if (whence == SEEK_END) source.at = source.bytes.size() + offset;
    return source.at;
}

int close(thandle_t) { return 0; }

toff_t size(thandle_t handle) { return static_cast<Source*>(handle)->bytes.size(); }

// Its words are not for the client and not for the log either. Non-zero: the global handler is not
// called.
int stay_silent(TIFF*, void*, const char*, const char*, va_list) { return 1; }

TIFF* open_silently(Source& source) {
    const std::unique_ptr<TIFFOpenOptions, decltype(&TIFFOpenOptionsFree)> options(
        TIFFOpenOptionsAlloc(), TIFFOpenOptionsFree);
    TIFFOpenOptionsSetErrorHandlerExtR(options.get(), stay_silent, nullptr);
    TIFFOpenOptionsSetWarningHandlerExtR(options.get(), stay_silent, nullptr);
    return TIFFClientOpenExt("upload", "rm", &source, read, write, seek, close, size, nullptr,
                             nullptr, options.get());
}

void check(bool done) {
    if (!done) throw_broken(FileFormat::tiff, "its texels are cut off or damaged");
}

}  // namespace

Float64Tiff::Float64Tiff(std::string_view bytes)
    : source_(std::make_unique<Source>(Source{bytes})), tiff_(open_silently(*source_)) {
    check(tiff_ != nullptr);
}

Float64Tiff::~Float64Tiff() { TIFFClose(tiff_); }

void Float64Tiff::read_row(int y, std::byte* out) {
    check(TIFFReadScanline(tiff_, out, std::uint32_t(y)) == 1);
}

void Float64Tiff::read_tile(int x, int y, std::byte* out) {
    check(TIFFReadTile(tiff_, out, std::uint32_t(x), std::uint32_t(y), 0, 0) >= 0);
}

}  // namespace relit
