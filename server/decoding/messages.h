// What the server and its decoding processes say to each other, over sockets that keep messages
// apart (SOCK_SEQPACKET). Both ends are the same program: the structs are sent as they are. What
// comes from a process that has seen an image is not trusted: it is numbers only, checked in
// DecodePool.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <type_traits>

#include "core/io/decode.h"

namespace relit::server {

/// The first argument that makes relitd the helper, and where the helper has its socket.
inline constexpr const char* decode_helper_argument = "decode-helper";
inline constexpr int decode_helper_socket = 3;

/// What a process may use, beside what it has when it starts.
struct DecodeAllowance {
    std::uint64_t memory_bytes = 0;  ///< of address space
    std::uint64_t file_bytes = 0;    ///< the largest file, that is the texels
    std::uint32_t cpu_s = 0;
};

/// Server to helper. `start` comes with the process's end of a socket.
struct HelperOrder {
    enum class Kind : std::uint32_t { start, kill };
    Kind kind = Kind::start;
    std::uint64_t process = 0;  ///< a number that the server gives
    DecodeAllowance allowance{};
};

/// Server to process, once; with the file's bytes and, where texels are wanted, a file for them.
struct DecodeJob {
    DecodeLimits limits{};
    std::uint64_t size_bytes = 0;
    bool texels = false;
};

/// Process to server: `started` as soon as it has its job, then how it ended.
struct DecodeReport {
    enum Kind : std::uint32_t { started, decoded, refused };
    std::uint32_t kind = started;
    std::uint32_t confined = 0;  ///< 1: the kernel filters its system calls
    // decoded: an ImageInfo
    std::uint32_t format = 0;
    std::uint32_t type = 0;
    std::int32_t width = 0;
    std::int32_t height = 0;
    std::int32_t channels = 0;
    std::uint32_t has_alpha = 0;
    std::uint32_t associated = 0;
    // refused
    std::uint32_t code = 0;   ///< in refusal_codes()
    std::uint32_t limit = 0;  ///< in refusal_limits()
    std::array<char, 400> detail{};
};

/// The codes that a process may refuse an image with.
[[nodiscard]] std::span<const std::string_view> refusal_codes();

/// And the settings that may be behind it; the first is none.
[[nodiscard]] std::span<const std::string_view> refusal_limits();

/// Descriptors that come with a message; closed with it unless taken.
class Descriptors {
public:
    Descriptors() = default;
    ~Descriptors();
    Descriptors(const Descriptors&) = delete;
    Descriptors& operator=(const Descriptors&) = delete;

    [[nodiscard]] int take(std::size_t index);  ///< -1 where there is none
    void add(int descriptor);

private:
    std::array<int, 2> descriptors_{-1, -1};
};

/// @return false when the other end is gone
[[nodiscard]] bool send_bytes(int socket, std::span<const std::byte> message,
                              std::span<const int> descriptors);

/// Waits for a message of exactly that size. @return false at the end, or for any other message
[[nodiscard]] bool receive_bytes(int socket, std::span<std::byte> message,
                                 Descriptors* descriptors);

template <class Message>
[[nodiscard]] bool send_message(int socket, const Message& message,
                                std::span<const int> descriptors = {}) {
    static_assert(std::is_trivially_copyable_v<Message>);
    return send_bytes(socket, std::as_bytes(std::span(&message, 1)), descriptors);
}

template <class Message>
[[nodiscard]] std::optional<Message> receive_message(int socket,
                                                     Descriptors* descriptors = nullptr) {
    static_assert(std::is_trivially_copyable_v<Message>);
    Message message;
    if (!receive_bytes(socket, std::as_writable_bytes(std::span(&message, 1)), descriptors))
        return std::nullopt;
    return message;
}

}  // namespace relit::server
