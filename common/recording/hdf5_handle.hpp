// An open object of HDF5 that is closed at the end of its scope. It does not need HDF5's own header, which stays in
// .cpp files.
#pragma once
#include <cstdint>
#include <utility>

namespace osteon {

class Hdf5Handle {
 public:
  using Close = int (*)(std::int64_t id);

  Hdf5Handle() = default;
  // `id` as HDF5 returned it: negative if opening failed.
  Hdf5Handle(std::int64_t id, Close close) noexcept : id_(id), close_(close) {}
  ~Hdf5Handle() { reset(); }
  Hdf5Handle(Hdf5Handle&& other) noexcept : id_(std::exchange(other.id_, -1)), close_(other.close_) {}
  Hdf5Handle& operator=(Hdf5Handle&& other) noexcept {
    if (this == &other) return *this;
    reset();
    id_ = std::exchange(other.id_, -1);
    close_ = other.close_;
    return *this;
  }

  [[nodiscard]] bool ok() const noexcept { return id_ >= 0; }
  [[nodiscard]] std::int64_t id() const noexcept { return id_; }
  // Returns false if closing failed, as it does when the disk is full.
  bool reset() noexcept {
    const std::int64_t id = std::exchange(id_, -1);
    return id < 0 || close_(id) >= 0;
  }
  // Leaves the object open, for one that a failed disk keeps from being closed.
  void abandon() noexcept { id_ = -1; }

 private:
  std::int64_t id_ = -1;
  Close close_ = nullptr;
};

}  // namespace osteon
