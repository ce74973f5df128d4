#include "server/access/api_keys.h"

#include <fcntl.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <iterator>
#include <stdexcept>
#include <utility>

#include "server/storage/files.h"
#include "server/storage/sha256.h"
#include "server/text.h"

namespace relit::server {
namespace {

constexpr std::size_t most_keys = 1000;
constexpr std::size_t largest_file = 256 << 10;
constexpr std::size_t shortest_key = 16, longest_key = 256, longest_name = 64;
constexpr std::chrono::seconds pause_between_looks{1};

constexpr Scope scopes[] = {Scope::read, Scope::render, Scope::admin};

// The next word, taken off the line; empty at its end.
std::string_view next_word(std::string_view& line) {
    line = trimmed(line);
    const auto word = line.substr(0, line.find_first_of(" \t"));
    line.remove_prefix(word.size());
    return word;
}

[[noreturn]] void refuse(int line, const std::string& words) {
    throw std::runtime_error("line " + std::to_string(line) + ": " + words);
}

ApiKey parse_line(std::string_view text, int line) {
    const auto secret = next_word(text), scope = next_word(text), name = next_word(text);
    // RFC 6750, 2.1: what a Bearer token may consist of.
    if (secret.size() < shortest_key || secret.size() > longest_key ||
        !consists_of(secret, lower_letters, upper_letters, digits, "-._~+/="))
        refuse(line, "a key has 16 to 256 letters, digits and -._~+/=");
    const auto* const known = std::find_if(std::begin(scopes), std::end(scopes),
                                           [&](Scope one) { return name_of(one) == scope; });
    if (known == std::end(scopes))
        refuse(line, "after the key stands its scope: read, render or admin");
    if (name.size() > longest_name ||
        !consists_of(name, lower_letters, upper_letters, digits, "-._"))
        refuse(line, "a name has at most 64 letters, digits and -._");
    if (!trimmed(text).empty()) refuse(line, "more than a key, its scope and its name");
    return {.secret = std::string(secret),
            .scope = *known,
            .name = name.empty() ? "line-" + std::to_string(line) : std::string(name),
            .digest = sha256_hex(secret)};
}

[[noreturn]] void fail_to_read() {
    throw std::runtime_error(std::string("cannot be read: ") + std::strerror(errno));
}

void check_who_may_use_it(const File& file) {
    struct stat status {};
    if (::fstat(file.descriptor(), &status) != 0) fail_to_read();
    if (!S_ISREG(status.st_mode)) throw std::runtime_error("is no file");
    if (status.st_uid != 0 && status.st_uid != ::geteuid())
        throw std::runtime_error("belongs to another user than relitd's and root");
    if ((status.st_mode & (S_IWGRP | S_IRWXO)) != 0)
        throw std::runtime_error(
            "may be written by its group or used by everybody: chmod 600 puts that right");
}

std::string text_of(const File& file) {
    std::string text;
    std::array<char, 16 << 10> piece{};
    for (;;) {
        const auto got = ::read(file.descriptor(), piece.data(), piece.size());
        if (got < 0) fail_to_read();
        if (got == 0) return text;
        text.append(piece.data(), std::size_t(got));
        if (text.size() > largest_file) throw std::runtime_error("is larger than 256 KiB");
    }
}

KeyList read_keys(const std::filesystem::path& path) {
    const File file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
    if (!file.is_open()) fail_to_read();
    check_who_may_use_it(file);
    return parse_api_keys(text_of(file));
}

}  // namespace

KeyList parse_api_keys(std::string_view text) {
    KeyList keys;
    for (int number = 1; !text.empty(); ++number) {
        auto line = text.substr(0, text.find('\n'));
        text.remove_prefix(std::min(line.size() + 1, text.size()));
        if (line.ends_with('\r')) line.remove_suffix(1);
        line = trimmed(line);
        if (line.empty() || line.starts_with('#')) continue;
        ApiKey key = parse_line(line, number);
        if (find_key(keys, key.secret)) refuse(number, "the key is there twice");
        keys.push_back(std::move(key));
        if (keys.size() > most_keys) refuse(number, "there are more than 1000 keys");
    }
    if (keys.empty()) throw std::runtime_error("there is no key in it");
    return keys;
}

const ApiKey* find_key(const KeyList& keys, std::string_view sent) {
    const std::string digest = sha256_hex(sent);  // all of one length
    const ApiKey* found = nullptr;
    for (const ApiKey& key : keys)
        if (equal_secrets(key.digest, digest)) found = &key;
    return found;
}

ApiKeys::ApiKeys(std::filesystem::path file) : file_(std::move(file)) {
    try {
        version_ = version();
        keys_ = std::make_shared<const KeyList>(read_keys(file_));
    } catch (const std::runtime_error& error) {
        throw std::runtime_error("--api-keys " + file_.string() + ": " + error.what());
    }
    looked_ = std::chrono::steady_clock::now();
}

ApiKeys::Version ApiKeys::version() const {
    struct stat status {};
    if (::stat(file_.c_str(), &status) != 0) return {};
    return {status.st_dev, status.st_ino, status.st_size, status.st_ctim.tv_sec,
            status.st_ctim.tv_nsec};
}

// The version is taken first: a change while it is read is seen the next time.
void ApiKeys::look() {
    const Version now = version();
    if (now == version_) return;
    version_ = now;
    try {
        keys_ = std::make_shared<const KeyList>(read_keys(file_));
        spdlog::info("api-keys: read again, {} keys", keys_->size());
    } catch (const std::runtime_error& error) {
        spdlog::error("api-keys: the keys before stay, for the changed file {}", error.what());
    }
}

std::shared_ptr<const KeyList> ApiKeys::current() {
    const std::scoped_lock lock(mutex_);
    const auto now = std::chrono::steady_clock::now();
    if (now - looked_ >= pause_between_looks) {
        looked_ = now;
        look();
    }
    return keys_;
}

}  // namespace relit::server
