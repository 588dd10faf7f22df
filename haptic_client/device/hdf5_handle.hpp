// An open object of HDF5, closed at the end of its scope. Without HDF5's own header, which stays in .cpp files.
#pragma once
#include <cstdint>
#include <utility>

namespace osteon::haptic {

class Hdf5Handle {
 public:
  using Close = int (*)(std::int64_t id);

  Hdf5Handle() = default;
  // `id` as HDF5 gave it: negative for what could not be opened.
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
  // False where closing failed, as it does when the disk is full.
  bool reset() noexcept {
    const std::int64_t id = std::exchange(id_, -1);
    return id < 0 || close_(id) >= 0;
  }
  // Left open: for what a failed disk keeps from being closed.
  void abandon() noexcept { id_ = -1; }

 private:
  std::int64_t id_ = -1;
  Close close_ = nullptr;
};

}  // namespace osteon::haptic
