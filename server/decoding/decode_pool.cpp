#include "server/decoding/decode_pool.h"

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>
#include <sys/eventfd.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <limits>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "server/error_codes.h"

extern char** environ;  // NOLINT: POSIX declares it nowhere

namespace relit::server {
namespace {

using Clock = std::chrono::steady_clock;

// A process costs 5 ms to make. So it is kept, but only for images after which that would be felt,
// and not for many of them: what one may have done to it does not reach far.
constexpr auto quick = std::chrono::milliseconds(50);
constexpr int most_images = 50;

constexpr std::size_t piece_bytes = 8u << 20;

[[noreturn]] void fail_decoding() {
    throw Error(error_code::not_ready, "The server cannot decode images now.");
}

// --- What goes there and comes back --------------------------------------------------------------

std::unique_ptr<File> anonymous_file() {
    auto file = std::make_unique<File>(::memfd_create("relit-image", MFD_CLOEXEC));
    if (!file->is_open()) fail_decoding();
    return file;
}

std::unique_ptr<File> file_of(std::string_view bytes) {
    auto file = anonymous_file();
    while (!bytes.empty()) {
        const auto written = ::write(file->descriptor(), bytes.data(), bytes.size());
        if (written < 0 && errno == EINTR) continue;
        if (written <= 0) fail_decoding();
        bytes.remove_prefix(std::size_t(written));
    }
    return file;
}

// Piece by piece, each given back to the system as soon as it is here: in memory there is one image.
Texels values_in(int file, std::size_t count) {
    Texels values;
    values.reserve(count);
    while (values.size() < count) {
        const std::size_t done = values.size();
        values.resize(std::min(count, done + piece_bytes / sizeof(float)));
        const auto piece = std::as_writable_bytes(std::span(values).subspan(done));
        const off_t place = off_t(done * sizeof(float));
        for (std::size_t at = 0; at < piece.size();) {
            const auto got = ::pread(file, piece.data() + at, piece.size() - at, place + off_t(at));
            if (got < 0 && errno == EINTR) continue;
            if (got <= 0) fail_decoding();
            at += std::size_t(got);
        }
        if (count * sizeof(float) > piece_bytes)
            ::fallocate(file, FALLOC_FL_PUNCH_HOLE | FALLOC_FL_KEEP_SIZE, place,
                        off_t(piece.size()));
    }
    return values;
}

bool fits(const ImageInfo& info, const DecodeLimits& limits) {
    return info.width >= 1 && info.height >= 1 && info.width <= limits.max_side &&
           info.height <= limits.max_side && info.channels >= 1 && info.channels <= 4 &&
           std::int64_t(info.width) * info.height <= limits.max_pixels &&
           (!info.has_alpha || info.channels == 2 || info.channels == 4) &&
           (!info.associated || info.has_alpha);
}

bool has_size(int file, std::size_t size) {
    struct stat facts {};
    return ::fstat(file, &facts) == 0 && facts.st_size == off_t(size);
}

// Nothing where the report is none of success, or makes no sense: its process was no longer under our
// control then.
std::optional<ImageInfo> checked_info(const std::optional<DecodeReport>& report,
                                      const DecodeLimits& limits, FileFormat format, int texels) {
    if (!report || report->kind != DecodeReport::decoded ||
        report->format != std::uint32_t(format) ||
        report->type > std::uint32_t(SampleType::float64))
        return std::nullopt;
    const ImageInfo info{
        format,           SampleType(report->type), report->width,          report->height,
        report->channels, report->has_alpha != 0,   report->associated != 0};
    if (!fits(info, limits)) return std::nullopt;
    if (texels >= 0 && !has_size(texels, info.value_count() * sizeof(float))) return std::nullopt;
    return info;
}

// Printable, and ended.
std::string checked_detail(const DecodeReport& report) {
    std::string detail(report.detail.begin(),
                       std::find(report.detail.begin(), report.detail.end(), '\0'));
    for (char& c : detail)
        if (c < ' ' || c > '~') c = '?';
    return detail;
}

// --- Waiting -------------------------------------------------------------------------------------

// A descriptor that can be read once a stop is asked for.
class StopSignal {
public:
    explicit StopSignal(const std::stop_token& stop)
        : event_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)),
          told_(stop, [this] { ::eventfd_write(event_.descriptor(), 1); }) {}
    [[nodiscard]] int descriptor() const { return event_.descriptor(); }

private:
    File event_;
    std::stop_callback<std::function<void()>> told_;
};

enum class Woken { report, stop, deadline };

Woken wait_for_report(int socket, const StopSignal& stop, Clock::time_point until) {
    pollfd waiting[2] = {{.fd = socket, .events = POLLIN, .revents = 0},
                         {.fd = stop.descriptor(), .events = POLLIN, .revents = 0}};
    for (;;) {
        const auto left = std::chrono::ceil<std::chrono::milliseconds>(until - Clock::now());
        const auto timeout = std::clamp<long long>(left.count(), 0, 1'000'000);
        const int ready = ::poll(waiting, 2, int(timeout));
        if (ready < 0 && errno == EINTR) continue;
        if (waiting[1].revents != 0) return Woken::stop;
        if (waiting[0].revents != 0) return Woken::report;
        if (Clock::now() >= until) return Woken::deadline;
    }
}

// The end of a job that was given to a process.
struct Outcome {
    Woken woken = Woken::report;
    bool begun = false;
    bool confined = false;
    std::optional<DecodeReport> report;  // the last one; nothing where the process has ended
};

Outcome outcome_of(int socket, const StopSignal& stop, Clock::time_point until) {
    Outcome outcome;
    while ((outcome.woken = wait_for_report(socket, stop, until)) == Woken::report) {
        outcome.report = receive_message<DecodeReport>(socket);
        if (!outcome.report || outcome.begun) break;
        outcome.begun = true;
        outcome.confined = outcome.report->confined != 0;
    }
    return outcome;
}

[[noreturn]] void throw_abandoned(Woken woken, Clock::time_point deadline,
                                  std::chrono::milliseconds timeout) {
    if (woken == Woken::stop) throw Error(error_code::cancelled, "the request was abandoned");
    if (Clock::now() >= deadline)
        throw Error(error_code::timed_out, "the image was not decoded in time (render-timeout)", {},
                    "render-timeout");
    throw Error(error_code::too_costly,
                fmt::format("decoding the image takes longer than {} s (decode-timeout)",
                            std::chrono::duration<double>(timeout).count()),
                {}, "decode-timeout");
}

// A process that ended without an answer, or with one that it cannot have come to by itself.
struct Crash : Error {
    explicit Crash(FileFormat format)
        : Error(error_code::image_broken,
                fmt::format("the {} file broke its decoder", name_of(format))) {}
};

[[noreturn]] void throw_refusal(const std::optional<DecodeReport>& report, FileFormat format) {
    if (report && report->kind == DecodeReport::refused && report->code < refusal_codes().size() &&
        report->limit < refusal_limits().size())
        throw Error(refusal_codes()[report->code], checked_detail(*report), {},
                    refusal_limits()[report->limit]);
    spdlog::warn("decoding: a process {} at an image",
                 report ? "reported nonsense" : "ended without an answer");
    throw Crash(format);
}

DecodeAllowance allowance_of(const DecodePoolSettings& settings) {
    using std::chrono::ceil, std::chrono::seconds;
    return {
        .memory_bytes = settings.memory_bytes,
        .file_bytes = std::uint64_t(settings.limits.max_values) * sizeof(float),
        .cpu_s = std::uint32_t(ceil<seconds>(settings.timeout + most_images * quick).count() + 1)};
}

DecodeResult result_of(std::string_view code) {
    return code == error_code::cancelled || code == error_code::timed_out ? DecodeResult::abandoned
           : code == error_code::too_costly                               ? DecodeResult::too_costly
           : code == error_code::not_ready                                ? DecodeResult::failed
                                                                          : DecodeResult::refused;
}

}  // namespace

DecodePool::DecodePool(DecodePoolSettings settings, Metrics& metrics)
    : settings_(std::move(settings)),
      allowance_(allowance_of(settings_)),
      metrics_(metrics),
      slots_({.max_running = settings_.workers, .max_waiting = std::numeric_limits<int>::max()}) {
    const std::scoped_lock lock(mutex_);
    for (int i = 0; i < settings_.workers; ++i) ready_.push_back(new_process());
}

DecodePool::~DecodePool() { end_helper(); }

DecodedImage DecodePool::decode(std::string_view bytes, const DecodeControl& control) {
    const auto texels = anonymous_file();
    DecodedImage decoded;
    decoded.info = decode_to(bytes, control, texels->descriptor());
    decoded.image.width = decoded.info.width;
    decoded.image.height = decoded.info.height;
    decoded.image.channels = decoded.info.channels;
    decoded.image.values = values_in(texels->descriptor(), decoded.info.value_count());
    return decoded;
}

ImageInfo DecodePool::check(std::string_view bytes, const DecodeControl& control) {
    return decode_to(bytes, control, -1);
}

ImageDecoder DecodePool::decoder() {
    return {[this](std::string_view bytes, const DecodeControl& control) {
                return decode(bytes, control);
            },
            [this](std::string_view bytes, const DecodeControl& control) {
                return check(bytes, control);
            }};
}

// Counts how it ends.
ImageInfo DecodePool::decode_to(std::string_view bytes, const DecodeControl& control, int texels) {
    const auto begin = Clock::now();
    try {
        const ImageInfo info = in_a_process(bytes, control, texels);
        metrics_.count(DecodeResult::done);
        metrics_.decode_times.observe(Clock::now() - begin);
        return info;
    } catch (const Crash&) {
        metrics_.count(DecodeResult::crashed);
        throw;
    } catch (const Error& error) {
        metrics_.count(result_of(error.code));
        throw;
    }
}

ImageInfo DecodePool::in_a_process(std::string_view bytes, const DecodeControl& control,
                                   int texels) {
    const FileFormat format = sniff_format(bytes);  // what is no image needs no process
    const auto slot = slots_.wait_for_slot(control.deadline, control.stop);
    const auto file = file_of(bytes);
    const StopSignal stop(control.stop);
    const auto until = std::min(control.deadline, Clock::now() + settings_.timeout);
    const DecodeJob job{settings_.limits, bytes.size(), texels >= 0};
    const int files[] = {file->descriptor(), texels};
    // All that are ready may have been killed, and the helper; one of a new helper takes it.
    for (int attempt = 0; attempt < settings_.workers + 2; ++attempt) {
        Process process = take_process();
        const auto begin = Clock::now();
        const std::span<const int> sent(files, job.texels ? 2 : 1);
        Outcome outcome;
        if (send_message(process.socket->descriptor(), job, sent))
            outcome = outcome_of(process.socket->descriptor(), stop, until);
        std::optional<ImageInfo> info;
        if (outcome.woken == Woken::report)
            info = checked_info(outcome.report, settings_.limits, format, texels);
        if (info && Clock::now() - begin < quick && ++process.images < most_images)
            put_back(std::move(process));
        else replace(process);
        if (outcome.woken != Woken::report)
            throw_abandoned(outcome.woken, control.deadline, settings_.timeout);
        if (!outcome.begun) continue;  // it was gone before: not the image's fault
        if (!outcome.confined) tell_of_confinement();
        if (info) return *info;
        throw_refusal(outcome.report, format);
    }
    spdlog::error("decoding: no process takes an image");
    fail_decoding();
}

void DecodePool::tell_of_confinement() {
    const std::scoped_lock lock(mutex_);
    if (!std::exchange(told_of_confinement_, true))
        spdlog::warn("decoding: this system does not filter system calls; limits hold alone");
}

// --- Processes -----------------------------------------------------------------------------------

DecodePool::Process DecodePool::take_process() {
    const std::scoped_lock lock(mutex_);
    if (ready_.empty()) return new_process();
    Process process = std::move(ready_.front());
    ready_.pop_front();
    return process;
}

void DecodePool::put_back(Process process) {
    const std::scoped_lock lock(mutex_);
    ready_.push_front(std::move(process));
}

// It has ended, or is to end, whatever it thinks of that.
void DecodePool::replace(const Process& process) {
    const std::scoped_lock lock(mutex_);
    order({.kind = HelperOrder::Kind::kill, .process = process.number});
    try {
        if (int(ready_.size()) < settings_.workers) ready_.push_back(new_process());
    } catch (const Error&) {  // who needs one tries again
    }
}

// A helper that is gone took its processes along.
DecodePool::Process DecodePool::new_process() {
    int ends[2];
    if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends) != 0) fail_decoding();
    Process process{++last_number_, std::make_unique<File>(ends[0])};
    const File its_end(ends[1]);
    const HelperOrder start{HelperOrder::Kind::start, process.number, allowance_};
    if (helper_ && order(start, its_end.descriptor())) return process;
    start_helper();
    if (!order(start, its_end.descriptor())) fail_decoding();
    return process;
}

bool DecodePool::order(const HelperOrder& order, int socket) {
    const std::span<const int> sent(&socket, socket >= 0 ? 1 : 0);
    return send_message(helper_->descriptor(), order, sent);
}

void DecodePool::start_helper() {
    if (helper_) spdlog::warn("decoding: the helper has ended; starting another one");
    end_helper();
    ready_.clear();
    int ends[2];
    if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends) != 0) fail_decoding();
    helper_ = std::make_unique<File>(ends[0]);
    const File its_end(ends[1]);
    posix_spawn_file_actions_t actions;
    ::posix_spawn_file_actions_init(&actions);
    ::posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDWR, 0);
    ::posix_spawn_file_actions_adddup2(&actions, STDIN_FILENO, STDOUT_FILENO);
    ::posix_spawn_file_actions_adddup2(&actions, its_end.descriptor(), decode_helper_socket);
    ::posix_spawn_file_actions_addclosefrom_np(&actions, decode_helper_socket + 1);
    std::string name = "relitd", argument = decode_helper_argument;
    char* arguments[] = {name.data(), argument.data(), nullptr};
    const int failure = ::posix_spawn(&helper_pid_, settings_.program.c_str(), &actions, nullptr,
                                      arguments, environ);
    ::posix_spawn_file_actions_destroy(&actions);
    if (failure == 0) return;
    helper_pid_ = -1;
    spdlog::error("decoding: the helper cannot be started: {}", std::strerror(failure));
}

// It ends when its socket does, after its processes.
void DecodePool::end_helper() {
    helper_.reset();
    if (helper_pid_ < 0) return;
    while (::waitpid(helper_pid_, nullptr, 0) < 0 && errno == EINTR) {
    }
    helper_pid_ = -1;
}

}  // namespace relit::server
