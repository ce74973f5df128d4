#include "core/io/header.h"

#include <algorithm>
#include <array>
#include <cctype>

#include "core/base/error.h"

namespace relit {
namespace {

struct FormatNames {
    FileFormat format;
    std::string_view name;
    std::string_view title;  // in sentences
    std::string_view media_type;
};

constexpr std::array<FormatNames, 6> formats{{
    {FileFormat::png, "png", "PNG", "image/png"},
    {FileFormat::jpeg, "jpeg", "JPEG", "image/jpeg"},
    {FileFormat::webp, "webp", "WebP", "image/webp"},
    {FileFormat::tiff, "tiff", "TIFF", "image/tiff"},
    {FileFormat::exr, "exr", "OpenEXR", "image/x-exr"},
    {FileFormat::hdr, "hdr", "Radiance HDR", "image/vnd.radiance"},
}};

const FormatNames& names_of(FileFormat format) {
    return *std::find_if(formats.begin(), formats.end(),
                         [&](const FormatNames& row) { return row.format == format; });
}

bool is_tiff(std::string_view bytes) {
    using namespace std::string_view_literals;
    return bytes.starts_with("II*\0"sv) || bytes.starts_with("MM\0*"sv) ||  // classic
           bytes.starts_with("II+\0"sv) || bytes.starts_with("MM\0+"sv);    // BigTIFF
}

}  // namespace

std::string_view name_of(FileFormat format) { return names_of(format).name; }

std::string_view media_type_of(FileFormat format) { return names_of(format).media_type; }

std::string_view name_of(SampleType type) {
    switch (type) {
        case SampleType::uint8:
            return "uint8";
        case SampleType::uint16:
            return "uint16";
        case SampleType::uint32:
            return "uint32";
        case SampleType::int8:
            return "int8";
        case SampleType::int16:
            return "int16";
        case SampleType::int32:
            return "int32";
        case SampleType::float16:
            return "float16";
        case SampleType::float32:
            return "float32";
        case SampleType::float64:
            return "float64";
    }
    return {};
}

FileFormat sniff_format(std::string_view bytes) {
    if (bytes.starts_with("\x89PNG\r\n\x1a\n")) return FileFormat::png;
    if (bytes.starts_with("\xff\xd8\xff")) return FileFormat::jpeg;
    if (bytes.starts_with("RIFF") && bytes.substr(0, 12).ends_with("WEBP")) return FileFormat::webp;
    if (is_tiff(bytes)) return FileFormat::tiff;
    if (bytes.starts_with("\x76\x2f\x31\x01")) return FileFormat::exr;
    if (bytes.starts_with("#?RADIANCE") || bytes.starts_with("#?RGBE")) return FileFormat::hdr;
    throw Error(error_code::image_not_supported,
                "the bytes are not an image of a format that is read here: PNG, JPEG, WebP, TIFF, "
                "OpenEXR or Radiance HDR");
}

FileHeader read_header(std::string_view bytes, FileFormat format) {
    switch (format) {
        case FileFormat::png:
            return read_png_header(bytes);
        case FileFormat::jpeg:
            return read_jpeg_header(bytes);
        case FileFormat::webp:
            return read_webp_header(bytes);
        case FileFormat::tiff:
            return read_tiff_header(bytes);
        case FileFormat::exr:
            return read_exr_header(bytes);
        case FileFormat::hdr:
            return read_hdr_header(bytes);
    }
    return {};
}

void throw_broken(FileFormat format, const std::string& why) {
    throw Error(error_code::image_broken,
                "the " + std::string(names_of(format).title) + " file is broken: " + why);
}

void throw_unsupported(FileFormat format, const std::string& what) {
    throw Error(error_code::image_not_supported,
                std::string(names_of(format).title) + " files with " + what + " are not read here");
}

}  // namespace relit
