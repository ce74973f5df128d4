#include "core/io/encode.h"

#include <algorithm>
#include <cassert>
#include <memory>
#include <stdexcept>

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <webp/encode.h>

#include "core/base/error.h"
#include "core/io/jpeg_writer.h"
#include "core/io/oiio.h"
#include "core/io/picture_side.h"
#include "core/io/png_writer.h"
#include "core/io/strips.h"
#include "core/io/webp_picture.h"

namespace relit {
namespace {

[[noreturn]] void throw_cancelled() {
    throw Error(error_code::cancelled, "writing the picture was cancelled");
}

// --- OpenEXR, by OpenImageIO ---------------------------------------------------------------------

std::string write_with_openimageio(const char* plugin, OIIO::ImageSpec& spec, OIIO::TypeDesc type,
                                   const void* values) {
    configure_openimageio();
    const std::unique_ptr<OIIO::ImageOutput> output = OIIO::ImageOutput::create(plugin);
    if (!output) throw std::runtime_error(std::string("OpenImageIO has no writer for ") + plugin);
    std::vector<unsigned char> bytes;
    OIIO::Filesystem::IOVecOutput memory(bytes);
    OIIO::Filesystem::IOProxy* proxy = &memory;
    spec.attribute("oiio:ioproxy", OIIO::TypeDesc::PTR, &proxy);
    const bool written = output->open("picture", spec) && output->write_image(type, values);
    const bool closed = output->close();
    if (!written || !closed)
        throw std::runtime_error(std::string("the ") + plugin +
                                 " encoder failed: " + output->geterror());
    return std::string(bytes.begin(), bytes.end());
}

std::vector<std::string> exr_channels(int channels) {
    switch (channels) {
        case 1:
            return {"Y"};
        case 2:
            return {"Y", "A"};
        case 3:
            return {"R", "G", "B"};
        default:
            return {"R", "G", "B", "A"};
    }
}

std::string encode_exr(const Image& picture, const EncodeOptions& options) {
    assert(options.bit_depth == 16 || options.bit_depth == 32);
    const auto type = options.bit_depth == 16 ? OIIO::TypeDesc::HALF : OIIO::TypeDesc::FLOAT;
    OIIO::ImageSpec spec(picture.width, picture.height, picture.channels, type);
    spec.channelnames = exr_channels(picture.channels);
    spec.alpha_channel = picture.channels % 2 == 0 ? picture.channels - 1 : -1;
    // Level 1 takes two thirds of the time of the library's own level 4, for 5 % more bytes.
    spec.attribute("compression", options.effort == Effort::fast ? "zip:1" : "zip:4");
    spec.attribute("DateTime", "1970:01:01 00:00:00");  // without one, the writer takes the clock's
    for (const TextEntry& entry : options.text) spec.attribute(entry.keyword, entry.text);
    return write_with_openimageio("openexr", spec, OIIO::TypeDesc::FLOAT, picture.values.data());
}

// --- WebP, by libwebp: OpenImageIO's writer always takes the slowest method ----------------------

int append_to_string(const std::uint8_t* data, std::size_t size, const WebPPicture* picture) try {
    static_cast<std::string*>(picture->custom_ptr)->append(reinterpret_cast<const char*>(data), size);
    return 1;
} catch (const std::bad_alloc&) {
    return 0;
}

int goes_on(int /*percent*/, const WebPPicture* picture) {
    return !static_cast<const std::stop_token*>(picture->user_data)->stop_requested();
}

std::string encode_webp(const Image& picture, const EncodeOptions& options,
                        const EncodeControl& control) {
    WebPConfig config;
    if (!WebPConfigPreset(&config, WEBP_PRESET_DEFAULT, float(options.quality)))
        throw std::runtime_error("libwebp is of another version");
    config.method = options.effort == Effort::fast ? 0 : 4;
    std::string file;
    std::stop_token stop = control.stop;
    WebpPicture webp;
    webp.import(picture, control.executor, control.stop);
    webp.progress_hook = goes_on;
    webp.user_data = &stop;
    webp.writer = append_to_string;
    webp.custom_ptr = &file;
    const bool written = WebPEncode(&config, &webp) != 0;
    if (webp.error_code == VP8_ENC_ERROR_USER_ABORT) throw_cancelled();
    if (!written)
        throw std::runtime_error("the WebP encoder failed with code " +
                                 std::to_string(webp.error_code));
    return file;
}

// --- In strips -----------------------------------------------------------------------------------

template <class Picture>
void check_picture(const Picture& picture, const EncodeOptions& options,
                   const EncodeControl& control) {
    assert(picture.width > 0 && picture.height > 0 && picture.channels >= 1 &&
           picture.channels <= 4);
    assert(options.quality >= 1 && options.quality <= 100);
    if (control.stop.stop_requested()) throw_cancelled();
    if (options.format == PictureFormat::jpeg)
        check_side(picture.width, picture.height, options.format, "JPEG");
}

template <class Writer>
std::string written(Writer writer, const Image& picture, const EncodeControl& control) {
    writer.add(picture, control);
    return writer.finished();
}

template <class Writer>
std::string written(Writer writer, const PictureRows& picture, const EncodeControl& control) {
    const int step = band_rows(picture, writer.strip_rows());
    for (int y = 0; y < picture.height; y += step)
        writer.add(picture.rows({y, std::min(y + step, picture.height)}), control);
    return writer.finished();
}

bool has_strips(PictureFormat format) {
    return format == PictureFormat::png || format == PictureFormat::jpeg;
}

// @pre has_strips()
template <class Picture>
std::string in_strips(const Picture& picture, const EncodeOptions& options,
                      const EncodeControl& control) {
    const int width = picture.width, height = picture.height, channels = picture.channels;
    return options.format == PictureFormat::png
               ? written(PngWriter(width, height, channels, options), picture, control)
               : written(JpegWriter(width, height, channels, options.quality), picture, control);
}

}  // namespace

std::string encode(const Image& picture, const EncodeOptions& options,
                   const EncodeControl& control) {
    check_picture(picture, options, control);
    if (has_strips(options.format)) return in_strips(picture, options, control);
    return options.format == PictureFormat::webp ? encode_webp(picture, options, control)
                                                 : encode_exr(picture, options);
}

std::string encode(const PictureRows& picture, const EncodeOptions& options,
                   const EncodeControl& control) {
    check_picture(picture, options, control);
    if (has_strips(options.format)) return in_strips(picture, options, control);
    return encode(picture.rows({0, picture.height}), options, control);
}

std::vector<int> bit_depths_of(PictureFormat format) {
    switch (format) {
        case PictureFormat::png:
            return {8, 16};
        case PictureFormat::jpeg:
        case PictureFormat::webp:
            return {8};
        case PictureFormat::exr:
            break;
    }
    return {16, 32};
}

std::string media_type_of(PictureFormat format) {
    switch (format) {
        case PictureFormat::png:
            return "image/png";
        case PictureFormat::jpeg:
            return "image/jpeg";
        case PictureFormat::webp:
            return "image/webp";
        case PictureFormat::exr:
            return "image/x-exr";
    }
    return {};
}

int max_side_of(PictureFormat format) {
    switch (format) {
        case PictureFormat::jpeg:
            return 65500;  // libjpeg's, a little below the format's 65535
        case PictureFormat::webp:
            return WEBP_MAX_DIMENSION;
        case PictureFormat::png:
        case PictureFormat::exr:
            break;
    }
    return 1 << 20;
}

}  // namespace relit
