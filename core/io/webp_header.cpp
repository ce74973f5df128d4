// WebP (RIFF container, VP8 and VP8L): libwebp's own look at the header, which allocates nothing.
#include <webp/decode.h>

#include "core/io/header.h"

namespace relit {

FileHeader read_webp_header(std::string_view bytes) {
    WebPBitstreamFeatures features;
    const auto* data = reinterpret_cast<const std::uint8_t*>(bytes.data());
    if (WebPGetFeatures(data, bytes.size(), &features) != VP8_STATUS_OK)
        throw_broken(FileFormat::webp, "its header makes no sense or is cut off");
    if (features.has_animation) throw_unsupported(FileFormat::webp, "animation");
    FileHeader header;
    header.width = features.width;
    header.height = features.height;
    header.channels = features.has_alpha ? 4 : 3;
    header.held_whole = true;
    return header;
}

}  // namespace relit
