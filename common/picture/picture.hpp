// A picture with red, green and blue, drawn without a screen: points, bars, short texts, and its PNG file.
#pragma once
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/result.hpp"

namespace osteon::picture {

struct Colour {
  std::uint8_t red = 0, green = 0, blue = 0;
  friend bool operator==(const Colour&, const Colour&) = default;
};

inline constexpr Colour kWhiteInk{240, 240, 240}, kGreyInk{150, 150, 150}, kBlackInk{16, 18, 22};

// A mixture: `part` of `b`, 0 to 1, and the rest of `a`.
[[nodiscard]] Colour mixed(Colour a, Colour b, double part);

// Height of a line of text, pixels.
inline constexpr int kTextHeight = 9;

// Pixels count from the left and from the top. What lies beyond the picture is not drawn.
class Picture {
 public:
  Picture() = default;
  Picture(int width, int height, Colour colour);

  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
  [[nodiscard]] Colour at(int x, int y) const;
  void set(int x, int y, Colour colour);
  void fill(int x, int y, int width, int height, Colour colour);
  void paste(const Picture& other, int x, int y);
  // A character without a glyph, such as an umlaut, becomes a question mark. (x, y) is the upper left corner. `scale`:
  // pixels for each dot of a glyph, which is 5 dots wide and 7 high.
  void text(int x, int y, std::string_view text, Colour colour, int scale = 1);

  // The bytes of a PNG file. Error: internal (memory).
  [[nodiscard]] Result<std::string> png() const;

 private:
  int width_ = 0, height_ = 0;
  std::vector<Colour> pixels_;  // rows from the top
};

// Pixels from the first to the last dot.
[[nodiscard]] int text_width(std::string_view text, int scale = 1);

}  // namespace osteon::picture
