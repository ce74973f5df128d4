#include "core/io/webp_animation.h"

#include <cassert>
#include <cmath>
#include <stdexcept>

#include <webp/mux.h>

#include "core/base/error.h"
#include "core/io/webp_picture.h"

namespace relit {
namespace {

struct DeleteEncoder {
    void operator()(WebPAnimEncoder* encoder) const { WebPAnimEncoderDelete(encoder); }
};

struct Bytes : WebPData {
    Bytes() : WebPData() { WebPDataInit(this); }
    ~Bytes() { WebPDataClear(this); }
    Bytes(const Bytes&) = delete;
    Bytes& operator=(const Bytes&) = delete;
};

// Lossy frames as encode() makes them with the greater effort; lossless ones at level 2, which takes
// two fifths of the time of the default level 6 for a tenth more bytes.
WebPConfig config_of(const AnimationOptions& options) {
    WebPConfig config;
    const float quality = float(options.quality.value_or(85));
    const bool known = WebPConfigPreset(&config, WEBP_PRESET_DEFAULT, quality) &&
                       (options.quality || WebPConfigLosslessPreset(&config, 2));
    if (!known) throw std::runtime_error("libwebp is of another version");
    return config;
}

}  // namespace

struct WebpAnimation::State {
    [[nodiscard]] int time_ms() const {
        return int(std::lround(1000.0 * double(frames) / frames_per_second));
    }
    void check(int done) const {
        if (!done)
            throw std::runtime_error(std::string("the WebP encoder failed: ") +
                                     WebPAnimEncoderGetError(encoder.get()));
    }

    double frames_per_second;
    WebPConfig config;
    std::unique_ptr<WebPAnimEncoder, DeleteEncoder> encoder = nullptr;  // from the first picture on
    int width = 0;
    int height = 0;
    int frames = 0;
};

WebpAnimation::WebpAnimation(const AnimationOptions& options)
    : state_(new State{options.frames_per_second, config_of(options)}) {
    assert(options.frames_per_second >= 1 && options.frames_per_second <= 90);
}

WebpAnimation::~WebpAnimation() = default;

void WebpAnimation::add(const Image& picture, const Executor& executor) {
    State& state = *state_;
    assert(state.frames < 1'000'000);
    if (state.frames > 0 && (picture.width != state.width || picture.height != state.height))
        throw Error(error_code::invalid_value,
                    "it is " + std::to_string(picture.width) + " x " +
                        std::to_string(picture.height) + ", the frames before it are " +
                        std::to_string(state.width) + " x " + std::to_string(state.height));
    WebpPicture webp;
    webp.use_argb = 1;
    webp.import(picture, executor);
    if (!state.encoder) {
        state.width = picture.width;
        state.height = picture.height;
        state.encoder.reset(WebPAnimEncoderNew(picture.width, picture.height, nullptr));
        if (!state.encoder) throw std::runtime_error("the WebP encoder cannot begin");
    }
    state.check(WebPAnimEncoderAdd(state.encoder.get(), &webp, state.time_ms(), &state.config));
    ++state.frames;
}

std::string WebpAnimation::finish() {
    State& state = *state_;
    assert(state.frames > 0);
    state.check(WebPAnimEncoderAdd(state.encoder.get(), nullptr, state.time_ms(), nullptr));
    Bytes bytes;
    state.check(WebPAnimEncoderAssemble(state.encoder.get(), &bytes));
    return {reinterpret_cast<const char*>(bytes.bytes), bytes.size};
}

}  // namespace relit
