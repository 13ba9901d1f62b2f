#include "app/recent_pages.h"

#include <algorithm>

namespace pneuma::app {

net::HttpReply RecentPages::get(const std::string& name, const Clock& now,
                                const std::function<net::HttpReply()>& make) {
  constexpr int kept_for = 19;  // times what it took
  constexpr std::chrono::seconds kept_max{5};
  const auto begin = now();
  std::erase_if(pages_, [begin](const auto& page) { return page.second.until <= begin; });
  if (const auto found = pages_.find(name); found != pages_.end()) return found->second.reply;
  net::HttpReply reply = make();
  const auto end = now();
  pages_[name] = {reply, end + std::min<std::chrono::steady_clock::duration>(kept_for * (end - begin), kept_max)};
  return reply;
}

}  // namespace pneuma::app
