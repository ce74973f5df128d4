// /v1/batches: many renders that are accepted at once and made later.
#pragma once

#include "server/http/message.h"
#include "server/services.h"

namespace relit::server {

/// POST /v1/batches. Answered 202 when all frames are durable. The header Idempotency-Key makes it safe to
/// repeat: the same key and body have the same answer, and one batch.
/// @throws Error conflict (a request with this key is being worked on), key_reused, queue_full,
///         unsupported_media_type, not_found at the field that names an image; as parse_batch() and
///         JobStore
[[nodiscard]] Reply submit_batch(const Request& request, Services& services);

/// GET /v1/batches?limit=&after=, newest first. @throws Error invalid_value
[[nodiscard]] Reply list_batches(const Request& request, Services& services);

/// GET /v1/batches/{id}. @throws Error not_found
[[nodiscard]] Reply get_batch(const Request& request, Services& services);

/// DELETE /v1/batches/{id}: stops it and removes its pictures. @throws Error not_found
[[nodiscard]] Reply delete_batch(const Request& request, Services& services);

/// POST /v1/batches/{id}/retry: has the failed frames rendered again. @throws Error not_found
[[nodiscard]] Reply retry_batch(const Request& request, Services& services);

/// GET /v1/batches/{id}/frames/{n}: the picture; of a failed frame its problem document.
/// @throws Error not_found, conflict (it is not finished)
[[nodiscard]] Reply get_batch_frame(const Request& request, Services& services);

/// GET /v1/batches/{id}/events: Server-Sent Events, one for each finished frame, then `end`. Their ids
/// rise, also over restarts; Last-Event-ID goes on behind one. 204 where there is nothing more to come.
/// @throws Error not_found, malformed_request (Last-Event-ID), queue_full (as many streams as may be)
[[nodiscard]] Reply get_batch_events(const Request& request, Services& services);

/// GET /v1/batches/{id}/archive?format=tar|zip: the pictures under their names, and the problems of
/// failed frames as problems.json. Of a batch that is not finished the stream waits for each frame.
/// @throws Error not_found, invalid_value, queue_full
[[nodiscard]] Reply get_batch_archive(const Request& request, Services& services);

}  // namespace relit::server
