#include "server/storage/image_info_file.h"

#include <sstream>

namespace relit::server {
namespace {

constexpr FileFormat formats[] = {FileFormat::png,  FileFormat::jpeg, FileFormat::webp,
                                  FileFormat::tiff, FileFormat::exr,  FileFormat::hdr};
constexpr SampleType types[] = {SampleType::uint8,   SampleType::uint16,  SampleType::uint32,
                                SampleType::int8,    SampleType::int16,   SampleType::int32,
                                SampleType::float16, SampleType::float32, SampleType::float64};

template <typename Value, std::size_t size>
std::optional<Value> named(const Value (&values)[size], std::string_view name) {
    for (const Value value : values)
        if (name_of(value) == name) return value;
    return std::nullopt;
}

}  // namespace

std::string image_info_text(const ImageInfo& info) {
    std::ostringstream text;
    text << "relit-image 1\n"
         << "format " << name_of(info.format) << "\ntype " << name_of(info.type) << "\nwidth "
         << info.width << "\nheight " << info.height << "\nchannels " << info.channels << "\nalpha "
         << int(info.has_alpha) << '\n';
    return text.str();
}

std::optional<ImageInfo> parse_image_info(std::string_view text) {
    std::istringstream stream{std::string(text)};
    std::string word, format, type;
    ImageInfo info;
    int version = 0, alpha = 0;
    stream >> word >> version >> word >> format >> word >> type >> word >> info.width >> word >>
        info.height >> word >> info.channels >> word >> alpha;
    const auto known_format = named(formats, format);
    const auto known_type = named(types, type);
    if (!stream || !known_format || !known_type) return std::nullopt;
    info.format = *known_format;
    info.type = *known_type;
    info.has_alpha = alpha != 0;
    if (image_info_text(info) != text) return std::nullopt;
    return info;
}

}  // namespace relit::server
