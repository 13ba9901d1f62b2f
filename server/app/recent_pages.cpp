#include "app/recent_pages.h"

namespace pneuma::app {

net::HttpReply RecentPages::get(const std::string& name, const Clock& now,
                                const std::function<net::HttpReply()>& make) {
  constexpr int kept_for = 19;  // times what it took
  const auto begin = now();
  std::erase_if(pages_, [begin](const auto& page) { return page.second.until <= begin; });
  if (const auto found = pages_.find(name); found != pages_.end()) return found->second.reply;
  net::HttpReply reply = make();
  const auto end = now();
  pages_[name] = {reply, end + kept_for * (end - begin)};
  return reply;
}

}  // namespace pneuma::app
