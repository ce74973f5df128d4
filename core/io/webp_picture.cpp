#include "core/io/webp_picture.h"

#include <cstdint>
#include <stdexcept>
#include <vector>

#include "core/io/picture_side.h"
#include "core/io/quantise.h"

namespace relit {
namespace {

// Grey or colour, with or without alpha -> three or four channels.
std::vector<std::uint8_t> coloured(const Image& picture, const Executor& executor,
                                   const std::stop_token& stop) {
    std::vector<std::uint8_t> samples = quantised(picture, executor, stop);
    if (picture.channels > 2) return samples;
    std::vector<std::uint8_t> out;
    out.reserve(samples.size() * (picture.channels == 1 ? 3 : 2));
    for (std::size_t i = 0; i < samples.size(); i += std::size_t(picture.channels)) {
        out.insert(out.end(), 3, samples[i]);
        if (picture.channels == 2) out.push_back(samples[i + 1]);
    }
    return out;
}

}  // namespace

WebpPicture::WebpPicture() : WebPPicture() {
    if (!WebPPictureInit(this)) throw std::runtime_error("libwebp is of another version");
}

void WebpPicture::import(const Image& picture, const Executor& executor,
                         const std::stop_token& stop) {
    check_side(picture.width, picture.height, PictureFormat::webp, "WebP");
    const std::vector<std::uint8_t> samples = coloured(picture, executor, stop);
    width = picture.width;
    height = picture.height;
    const bool alpha = picture.channels % 2 == 0;
    const auto take = alpha ? WebPPictureImportRGBA : WebPPictureImportRGB;
    if (!take(this, samples.data(), picture.width * (alpha ? 4 : 3)))
        throw std::runtime_error("there is not enough memory for the WebP encoder");
}

}  // namespace relit
