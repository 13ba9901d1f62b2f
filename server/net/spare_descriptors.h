// File descriptors that are kept for when there are none left: with one given up, whoever asks then can be told.
#pragma once

#include <vector>

namespace pneuma::net {

class SpareDescriptors {
 public:
  SpareDescriptors() = default;
  ~SpareDescriptors();
  SpareDescriptors(const SpareDescriptors&) = delete;
  SpareDescriptors& operator=(const SpareDescriptors&) = delete;

  /// Takes as many as there may be; false where the process has too few left.
  bool fill();
  /// False where there is none.
  bool give_up_one();

 private:
  std::vector<int> files_;
};

}  // namespace pneuma::net
