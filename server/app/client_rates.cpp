#include "app/client_rates.h"

namespace pneuma::app {

std::shared_ptr<TokenBucket> ClientRates::commands_of(const std::string& client, TokenBucket::TimePoint now) {
  std::erase_if(commands_,
                [&](const auto& entry) { return entry.second.use_count() == 1 && entry.second->is_full(now); });
  std::shared_ptr<TokenBucket>& bucket = commands_[client];
  if (bucket == nullptr) bucket = std::make_shared<TokenBucket>(commands_per_s_, commands_burst_);
  return bucket;
}

}  // namespace pneuma::app
