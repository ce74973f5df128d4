#include "server/jobs/batch_news.h"

namespace relit::server {

void BatchNews::announce(const std::string& batch) {
    const std::scoped_lock lock(mutex_);
    const auto channel = channels_.find(batch);
    if (channel == channels_.end()) return;
    ++channel->second.announced;
    channel->second.changed.notify_all();
}

BatchNews::Watch::Watch(BatchNews& news, const std::string& batch) : news_(news), batch_(batch) {
    const std::scoped_lock lock(news_.mutex_);
    ++news_.channels_[batch_].watches;
}

BatchNews::Watch::~Watch() {
    const std::scoped_lock lock(news_.mutex_);
    const auto channel = news_.channels_.find(batch_);
    if (--channel->second.watches == 0) news_.channels_.erase(channel);
}

bool BatchNews::Watch::wait(std::chrono::milliseconds patience, const std::stop_token& stop) {
    std::unique_lock lock(news_.mutex_);
    Channel& channel = news_.channels_.at(batch_);
    const bool news =
        channel.changed.wait_for(lock, stop, patience, [&] { return channel.announced != seen_; });
    seen_ = channel.announced;
    return news;
}

}  // namespace relit::server
