// Open streams as the parts of a room see them: sinks, free of gRPC.
#pragma once
#include <cstddef>
#include <string>
#include <vector>

namespace osteon {

// What a room says to an open stream. Called under a lock of the part that says it: must return at once and never call
// back.
class StreamSink {
 public:
  virtual ~StreamSink() = default;
  virtual void end(const std::string& why) = 0;             // the server stops
  [[nodiscard]] virtual std::size_t waiting() const = 0;    // rows or blocks that the reader is behind
};

// The open streams of one kind.
template <class Sink>
class Audience {
 public:
  void add(Sink& sink) { sinks_.push_back(&sink); }
  // False: it was not among them.
  bool remove(Sink& sink) { return std::erase(sinks_, &sink) > 0; }
  template <class Call>
  void each(Call call) const {
    for (Sink* sink : sinks_) call(*sink);
  }
  [[nodiscard]] std::size_t size() const { return sinks_.size(); }

 private:
  std::vector<Sink*> sinks_;
};

}  // namespace osteon
