#include "server/decoding/messages.h"

#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "server/error_codes.h"

namespace relit::server {
namespace {

constexpr std::string_view codes[] = {error_code::image_not_supported, error_code::image_too_large,
                                      error_code::image_broken, error_code::too_costly};

constexpr std::string_view limits[] = {"",
                                       "max-image-pixels",
                                       "max-image-side",
                                       "max-interlaced-pixels",
                                       "max-image-channels",
                                       "max-image-values",
                                       "max-tile-bytes",
                                       "max-decode-memory"};

constexpr std::size_t max_descriptors = 2;

// A message and room for the descriptors that come with it.
struct Envelope {
    explicit Envelope(std::span<std::byte> message) : part{message.data(), message.size()} {
        header.msg_iov = &part;
        header.msg_iovlen = 1;
    }
    iovec part;
    msghdr header{};
    alignas(cmsghdr) char control[CMSG_SPACE(max_descriptors * sizeof(int))]{};
};

}  // namespace

std::span<const std::string_view> refusal_codes() { return codes; }

std::span<const std::string_view> refusal_limits() { return limits; }

Descriptors::~Descriptors() {
    for (const int descriptor : descriptors_)
        if (descriptor >= 0) ::close(descriptor);
}

int Descriptors::take(std::size_t index) { return std::exchange(descriptors_.at(index), -1); }

void Descriptors::add(int descriptor) {
    for (int& place : descriptors_)
        if (place < 0) {
            place = descriptor;
            return;
        }
    ::close(descriptor);
}

bool send_bytes(int socket, std::span<const std::byte> message, std::span<const int> descriptors) {
    Envelope envelope({const_cast<std::byte*>(message.data()), message.size()});  // only read
    if (!descriptors.empty()) {
        envelope.header.msg_control = envelope.control;
        envelope.header.msg_controllen = CMSG_SPACE(descriptors.size_bytes());
        cmsghdr* const rights = CMSG_FIRSTHDR(&envelope.header);
        rights->cmsg_level = SOL_SOCKET;
        rights->cmsg_type = SCM_RIGHTS;
        rights->cmsg_len = CMSG_LEN(descriptors.size_bytes());
        std::memcpy(CMSG_DATA(rights), descriptors.data(), descriptors.size_bytes());
    }
    ssize_t sent = 0;
    do sent = ::sendmsg(socket, &envelope.header, MSG_NOSIGNAL);
    while (sent < 0 && errno == EINTR);
    return sent == ssize_t(message.size());
}

bool receive_bytes(int socket, std::span<std::byte> message, Descriptors* descriptors) {
    Envelope envelope(message);
    if (descriptors) {
        envelope.header.msg_control = envelope.control;
        envelope.header.msg_controllen = sizeof envelope.control;
    }
    ssize_t received = 0;
    do received = ::recvmsg(socket, &envelope.header, MSG_CMSG_CLOEXEC);
    while (received < 0 && errno == EINTR);
    if (received <= 0) return false;
    for (cmsghdr* part = descriptors ? CMSG_FIRSTHDR(&envelope.header) : nullptr; part;
         part = CMSG_NXTHDR(&envelope.header, part)) {
        if (part->cmsg_level != SOL_SOCKET || part->cmsg_type != SCM_RIGHTS) continue;
        const std::size_t count = (part->cmsg_len - CMSG_LEN(0)) / sizeof(int);
        for (std::size_t i = 0; i < count; ++i) {
            int descriptor = -1;
            std::memcpy(&descriptor, CMSG_DATA(part) + i * sizeof(int), sizeof descriptor);
            descriptors->add(descriptor);
        }
    }
    return received == ssize_t(message.size()) && !(envelope.header.msg_flags & MSG_TRUNC);
}

}  // namespace relit::server
