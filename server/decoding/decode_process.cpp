#include "server/decoding/decode_process.h"

#include <spdlog/fmt/fmt.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <new>
#include <optional>

#include "server/decoding/confinement.h"
#include "server/error_codes.h"
#include "server/storage/files.h"

namespace relit::server {
namespace {

bool out_of_memory = false;

[[noreturn]] void note_lack_of_memory() {
    out_of_memory = true;
    throw std::bad_alloc();
}

// A file as memory.
class Mapping {
public:
    Mapping(int file, std::size_t size, int protection, int flags)
        : memory_(::mmap(nullptr, size, protection, flags, file, 0)), size_(size) {
        if (memory_ == MAP_FAILED) note_lack_of_memory();
    }
    ~Mapping() { ::munmap(memory_, size_); }
    Mapping(const Mapping&) = delete;
    Mapping& operator=(const Mapping&) = delete;
    [[nodiscard]] void* memory() const { return memory_; }

private:
    void* memory_;
    std::size_t size_;
};

// The file that the server reads the texels from, as memory; made with the first of them.
class SharedTexels {
public:
    explicit SharedTexels(int file) : file_(file) {}
    float* room(const ImageInfo& info) {
        if (!mapping_) {
            const std::size_t size = info.value_count() * sizeof(float);
            if (::ftruncate(file_, off_t(size)) != 0) note_lack_of_memory();
            mapping_.emplace(file_, size, PROT_READ | PROT_WRITE, MAP_SHARED);
        }
        return static_cast<float*>(mapping_->memory());
    }

private:
    int file_;
    std::optional<Mapping> mapping_;
};

DecodeReport decoded(const ImageInfo& info) {
    DecodeReport report{.kind = DecodeReport::decoded};
    report.format = std::uint32_t(info.format);
    report.type = std::uint32_t(info.type);
    report.width = info.width;
    report.height = info.height;
    report.channels = info.channels;
    report.has_alpha = info.has_alpha ? 1 : 0;
    report.associated = info.associated ? 1 : 0;
    return report;
}

std::uint32_t place_of(std::string_view word, std::span<const std::string_view> words) {
    return std::uint32_t(std::find(words.begin(), words.end(), word) - words.begin());
}

DecodeReport refused(const Error& error) {
    DecodeReport report{.kind = DecodeReport::refused};
    report.code = place_of(error.code, refusal_codes());
    report.limit = place_of(error.limit, refusal_limits());
    const std::string_view detail = error.what();
    std::copy_n(detail.begin(), std::min(detail.size(), report.detail.size() - 1),
                report.detail.begin());
    return report;
}

DecodeReport report_of(const DecodeJob& job, int file, int texels, std::uint64_t memory_bytes) try {
    const Mapping content(file, job.size_bytes, PROT_READ, MAP_PRIVATE);
    const std::string_view bytes(static_cast<const char*>(content.memory()), job.size_bytes);
    if (!job.texels) return decoded(decode(bytes, job.limits).info);
    SharedTexels shared(texels);
    return decoded(decode_into(
        bytes, job.limits, [&](const ImageInfo& info, std::size_t) { return shared.room(info); }));
} catch (const std::exception& failure) {
    if (out_of_memory)
        return refused({error_code::too_costly,
                        fmt::format("decoding the image takes more memory than the limit of {} "
                                    "bytes (max-decode-memory)",
                                    memory_bytes),
                        {},
                        "max-decode-memory"});
    const auto* const error = dynamic_cast<const Error*>(&failure);
    return refused(error ? *error : Error(error_code::image_broken, "the image cannot be decoded"));
}

// @return false: the server has no more of them, or is gone
bool do_job(int socket, const DecodeReport& begun, std::uint64_t memory_bytes) {
    Descriptors descriptors;
    const auto job = receive_message<DecodeJob>(socket, &descriptors);
    if (!job || !send_message(socket, begun)) return false;
    const File file(descriptors.take(0)), texels(descriptors.take(1));
    return send_message(socket,
                        report_of(*job, file.descriptor(), texels.descriptor(), memory_bytes));
}

}  // namespace

int run_decode_process(int socket, const DecodeAllowance& allowance) {
    DecodeReport begun{.kind = DecodeReport::started};
    begun.confined = confine(allowance, address_space_bytes()) ? 1 : 0;
    std::set_new_handler(note_lack_of_memory);
    while (do_job(socket, begun, allowance.memory_bytes)) {
    }
    return 0;
}

}  // namespace relit::server
