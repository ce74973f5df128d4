#include <algorithm>
#include <atomic>
#include <exception>
#include <new>
#include <thread>

#include "clients/cli/failure.h"
#include "clients/cli/frame_work.h"
#include "clients/cli/limits_here.h"
#include "core/base/error.h"
#include "server/scenes/picture_file.h"
#include "server/scenes/scene_loading.h"
#include "server/schema/scene_json.h"

namespace relit::cli {
namespace {

constexpr std::uint64_t cached_bytes = 1u << 30;  // of maps and what is made of them

// What the workers share.
class Workshop {
public:
    Workshop(std::span<const Frame> frames, FrameImages& images, int threads, FrameFolder& folder)
        : frames_(frames), images_(images), threads_(threads), folder_(folder) {}

    // A worker: takes frames until there are none, or one cannot be kept.
    void work() {
        const Executor executor(threads_);
        try {
            for (std::size_t i = next_++; i < frames_.size() && !broken_; i = next_++)
                make(frames_[i], executor);
        } catch (...) {
            if (!broken_.exchange(true)) failure_ = std::current_exception();
        }
    }

    // When all have ended.
    void rethrow() const {
        if (failure_) std::rethrow_exception(failure_);
    }

private:
    void make(const Frame& frame, const Executor& executor) {
        std::string picture;
        try {
            picture = rendered(frame, executor);
        } catch (const Failure& e) {
            return folder_.fail(frame, e.what());
        } catch (const Error& e) {
            return folder_.fail(frame, words_of(frame, e));
        } catch (const std::bad_alloc&) {
            return folder_.fail(frame, "there is not enough memory");
        } catch (const std::exception& e) {
            return folder_.fail(frame, e.what());
        }
        folder_.keep(frame, picture);
    }

    std::string rendered(const Frame& frame, const Executor& executor) {
        const auto description = server::parse_scene(frame.scene, limits_here().max_lights);
        const auto find = [&](const server::ImageSource& source) {
            return images_.get(source.text).bytes;
        };
        const Scene scene =
            server::load_scene(description, find, decode_here, limits_here(), executor, cache_);
        return server::picture_file(scene, description, frame.scene,
                                    {.executor = executor, .cache = &cache_})
            .bytes;
    }

    std::string words_of(const Frame& frame, const Error& error) const {
        const auto description = server::parse_scene(frame.scene, limits_here().max_lights);
        const std::string image = image_name(description, images_.known(), error.pointer);
        return (image.empty() ? "" : image + ": ") + part_of_line(error.what());
    }

    const std::span<const Frame> frames_;
    FrameImages& images_;
    const int threads_;  // of each worker
    FrameFolder& folder_;
    SharedCache cache_{cached_bytes};
    std::atomic<std::size_t> next_ = 0;
    std::atomic<bool> broken_ = false;
    std::exception_ptr failure_;  // written once, before broken_ is read at the end
};

}  // namespace

// Frames side by side, each on its part of the threads: nothing waits for the slowest row of a frame.
void render_frames_here(std::span<const Frame> frames, FrameImages& images, int threads,
                        FrameFolder& folder) {
    const int all = Executor(threads).threads();
    const int workers = std::clamp(int(frames.size()), 1, all);
    Workshop workshop(frames, images, std::max(1, all / workers), folder);
    std::vector<std::thread> working;
    for (int i = 0; i < workers; ++i) working.emplace_back([&] { workshop.work(); });
    for (std::thread& worker : working) worker.join();
    workshop.rethrow();
}

}  // namespace relit::cli
