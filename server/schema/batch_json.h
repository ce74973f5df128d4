// What the interface says of batches. Source: api.md, "Batches".
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "server/jobs/job_store.h"

namespace relit::server {

/// {"id", "status": "queued", "total", "done": 0, "failed": 0}: the answer to a submission, the same
/// however often it is repeated.
[[nodiscard]] std::string submitted_json(const JobStore::Submitted& batch);

/// {"id", "status", "priority", "total", "done", "failed", "created", "started", "finished",
/// "bytes", "problems": [{"frame", "name", "problem"}]}. Status is queued, running or done, which
/// says that every frame is done or failed; times are RFC 3339 in UTC, or null.
[[nodiscard]] std::string batch_json(const BatchFacts& batch,
                                     const std::vector<FrameFacts>& failed);

/// {"batches", "next"}: each as above but for the problems; null where there is no next page.
[[nodiscard]] std::string batch_list_json(const std::vector<BatchFacts>& batches,
                                          const std::optional<std::string>& next);

/// {"frame", "name", "status", "bytes" | "problem"} of a frame that is done or failed.
[[nodiscard]] std::string frame_event_json(const FrameFacts& frame);

/// {"id", "status", "total", "done", "failed"}: `status` is done, or deleted.
[[nodiscard]] std::string end_event_json(const BatchFacts& batch, bool deleted);

/// [{"frame", "name", "problem"}]
[[nodiscard]] std::string problems_json(const std::vector<FrameFacts>& failed);

}  // namespace relit::server
