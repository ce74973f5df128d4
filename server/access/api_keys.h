// Who may use the server: the keys of a file, several at once, so that a new one can be handed out
// before an old one goes. For Access, which asks for each request.
//
// The file has a line for each key: the key, its scope (read, render or admin; each includes those
// before it) and, if it likes, a name for the log and for the rate limit, which keys of one client
// share. Empty lines and lines that begin with # are left out.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "server/access/scope.h"

namespace relit::server {

struct ApiKey {
    std::string secret;  ///< never logged, never sent
    Scope scope = Scope::read;
    std::string name;    ///< "line-3" where the file says none
    std::string digest;  ///< of the secret: what is compared
};
using KeyList = std::vector<ApiKey>;

/// The keys of a file's text.
/// @throws std::runtime_error with a sentence for the operator that names the line and quotes no key:
///         no keys at all or more than 1,000; a key of less than 16 characters or with others than
///         letters, digits and -._~+/=; one that is there twice; another scope; a name of more than
///         64 characters or with others than letters, digits and -._
[[nodiscard]] KeyList parse_api_keys(std::string_view text);

/// The key that was sent; null: there is no such key. How long that takes does not depend on how
/// much of a key was guessed.
[[nodiscard]] const ApiKey* find_key(const KeyList& keys, std::string_view sent);

/// The keys of a file as it is now: it is read again when it has changed, which is looked at once a
/// second. What is wrong with a changed file is logged, and the keys before go on.
class ApiKeys {
public:
    /// @throws std::runtime_error as parse_api_keys(), and where the file cannot be read, belongs to
    ///         somebody else than us or root, or may be written by its group or used by others
    explicit ApiKeys(std::filesystem::path file);

    /// Stays valid whatever happens to the file.
    [[nodiscard]] std::shared_ptr<const KeyList> current();

private:
    /// What tells one version of a file from another; all zero where there is none.
    struct Version {
        std::uint64_t device = 0, inode = 0;
        std::int64_t size = 0, changed_s = 0, changed_ns = 0;
        bool operator==(const Version&) const = default;
    };
    [[nodiscard]] Version version() const;
    void look();

    const std::filesystem::path file_;
    std::mutex mutex_;
    Version version_;
    std::shared_ptr<const KeyList> keys_;
    std::chrono::steady_clock::time_point looked_;
};

}  // namespace relit::server
