// The pictures of batches as files named by their content, one folder for each batch. For
// jobs/batches.h; the store of batches says which of them there are.
#pragma once

#include <condition_variable>
#include <deque>
#include <filesystem>
#include <functional>
#include <mutex>
#include <optional>
#include <set>
#include <span>
#include <stop_token>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "server/shared_bytes.h"

namespace relit::server {

/// Safe from any thread, but for put() and remove() of the same batch at the same time.
///
/// Layout: results/<batch>/<SHA-256 of the bytes>, incoming/ for temporary names, removed/ for folders
/// whose files are being removed. A file is there whole or not at all; what a crash leaves behind is
/// removed by sweep().
class ResultFiles {
public:
    /// @param folder  made when the first file is put; what it is in has to be there
    explicit ResultFiles(std::filesystem::path folder);
    ResultFiles(const ResultFiles&) = delete;
    ResultFiles& operator=(const ResultFiles&) = delete;

    struct NewPicture {
        std::string batch;
        std::string_view bytes;
    };
    /// Stores pictures, durably when this returns. Several at once cost a fraction of one by one.
    /// @return their names
    /// @throws Error storage_full, storage_failed; some of them may be there then
    [[nodiscard]] std::vector<std::string> put(std::span<const NewPicture> pictures) const;

    /// The bytes, mapped: they stay readable when the batch is removed meanwhile.
    /// @throws Error not_found, storage_failed
    [[nodiscard]] SharedBytes get(const std::string& batch, const std::string& name) const;

    /// Removes all files of a batch: it has none when this returns, however many it had. Their room is
    /// free a millisecond per file later. What cannot be removed is left to the next sweep.
    void remove(const std::string& batch) noexcept;

    /// Removes every file that `known` does not name, and temporary ones. While nobody puts.
    /// @param known  the names of the files of a batch; none: there is no such batch
    /// @throws what `known` throws
    void sweep(const std::function<std::set<std::string>(const std::string& batch)>& known);

private:
    void clear_later(const std::filesystem::path& folder);
    void clear_folders(const std::stop_token& stop);

    const std::filesystem::path folder_;
    std::mutex mutex_;
    std::condition_variable_any changed_;
    std::deque<std::filesystem::path> to_clear_;
    std::jthread clearing_;  // the last member: it uses those above
};

}  // namespace relit::server
