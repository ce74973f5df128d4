// What a viewer shows of an animated WebP, by libwebp's own decoder of animations.
#pragma once

#include <webp/demux.h>

#include <cstdint>
#include <stdexcept>
#include <string_view>
#include <vector>

namespace relit::test {

struct ShownFrame {
    std::vector<std::uint8_t> rgba;
    int end_ms = 0;
};

struct ShownAnimation {
    int width = 0;
    int height = 0;
    int loops = -1;  ///< 0: for ever
    std::vector<ShownFrame> frames;
};

/// @throws std::runtime_error when it is no animation, or broken
inline ShownAnimation shown(std::string_view webp) {
    const WebPData data{reinterpret_cast<const std::uint8_t*>(webp.data()), webp.size()};
    WebPAnimDecoder* decoder = WebPAnimDecoderNew(&data, nullptr);
    WebPAnimInfo info{};
    if (!decoder || !WebPAnimDecoderGetInfo(decoder, &info))
        throw std::runtime_error("this is no animated WebP");
    ShownAnimation animation{
        int(info.canvas_width), int(info.canvas_height), int(info.loop_count), {}};
    std::uint8_t* canvas = nullptr;
    for (int end_ms = 0; WebPAnimDecoderGetNext(decoder, &canvas, &end_ms);)
        animation.frames.push_back(
            {{canvas, canvas + std::size_t(4) * info.canvas_width * info.canvas_height}, end_ms});
    const bool whole = animation.frames.size() == info.frame_count;
    WebPAnimDecoderDelete(decoder);
    if (!whole) throw std::runtime_error("a frame of the animated WebP is broken");
    return animation;
}

}  // namespace relit::test
