// Pictures one after the other -> the bytes of one animated WebP, by libwebp's own encoder of
// animations. One picture at a time is here whole; what is compressed stays in memory to the end.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "core/base/parallel.h"
#include "core/image/image.h"

namespace relit {

struct AnimationOptions {
    double frames_per_second = 25;    ///< 1 to 90: browsers show what is faster at ten a second
    std::optional<int> quality = 85;  ///< 1..100; nothing: lossless
};

/// An animation that begins again at its end, for ever. The n-th picture is shown from n times a
/// frame's duration on, rounded to milliseconds; one that equals the picture before it makes that
/// one last longer. Same pictures and options, same bytes.
class WebpAnimation {
public:
    /// @throws std::runtime_error when libwebp is of another version
    explicit WebpAnimation(const AnimationOptions& options);
    ~WebpAnimation();

    /// Adds a picture in 8 bits.
    /// @param picture  as encode() takes it for 8 bits, as large as the first one; channels may
    ///                 differ
    /// @throws Error invalid_value when its size differs or is above max_side_of(webp);
    ///         std::runtime_error when the encoder fails (out of memory)
    /// @pre not more than a million pictures
    void add(const Image& picture, const Executor& executor);

    /// The whole file. @pre at least one picture; nothing is added afterwards
    /// @throws std::runtime_error when the encoder fails (out of memory, more than 4 GB)
    [[nodiscard]] std::string finish();

private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace relit
