// Which vectors are computed with: a matter of what the processor has and what was asked for.
#include "cdprcal/lanes/processor.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cdprcal/error.hpp"

namespace cdprcal::lanes {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

TEST(Processor, HasTheVectorsWhoseInstructionsItHasAll) {
  const Features all{
      .avx2 = true, .fma = true, .avx512f = true, .avx512dq = true, .avx512vl = true};
  EXPECT_EQ(widest({}), Processor::any);
  EXPECT_EQ(widest({.avx2 = true, .fma = true}), Processor::avx2);
  EXPECT_EQ(widest(all), Processor::avx512);
  // Each kernel is compiled for several kinds of instructions, and needs every one of them.
  for (bool Features::* const one : {&Features::avx2, &Features::fma}) {
    Features without = all;
    without.*one = false;
    EXPECT_EQ(widest(without), Processor::any);
  }
  for (bool Features::* const one :
       {&Features::avx512f, &Features::avx512dq, &Features::avx512vl}) {
    Features without = all;
    without.*one = false;
    EXPECT_EQ(widest(without), Processor::avx2);
  }
}

TEST(Processor, IsTheWidestOrWhatTheWordSays) {
  for (const Processor most : {Processor::any, Processor::avx2, Processor::avx512}) {
    EXPECT_EQ(choose_processor("", most), most);
    EXPECT_EQ(choose_processor("any", most), Processor::any);
  }
  EXPECT_EQ(choose_processor("avx2", Processor::avx2), Processor::avx2);
  EXPECT_EQ(choose_processor("avx2", Processor::avx512), Processor::avx2);
  EXPECT_EQ(choose_processor("avx512", Processor::avx512), Processor::avx512);
}

TEST(Processor, IsRefusedWhereTheWordIsWrongOrItDoesNotExistHere) {
  EXPECT_THAT([] { choose_processor("widest", Processor::avx512); },
              ThrowsMessage<InputError>(AllOf(
                  HasSubstr("'widest' is no kind of them"),
                  HasSubstr("set the environment variable CDPRCAL_VECTORS to any, avx2 or"))));
  EXPECT_THAT([] { choose_processor("AVX2", Processor::avx512); },
              ThrowsMessage<InputError>(HasSubstr("'AVX2'")));
  EXPECT_THAT([] { choose_processor("avx512", Processor::avx2); },
              ThrowsMessage<InputError>(AllOf(HasSubstr("none of the kind avx512"),
                                              HasSubstr("CDPRCAL_VECTORS to avx2, or"))));
  EXPECT_THAT([] { choose_processor("avx2", Processor::any); },
              ThrowsMessage<InputError>(HasSubstr("CDPRCAL_VECTORS to any, or")));
}

TEST(Processor, CanBeChangedWhileTheProgramRunsAndChangedBack) {
  const Processor before = processor();
  use_processor(Processor::any);  // which every processor has
  EXPECT_EQ(processor(), Processor::any);
  use_processor(before);
  EXPECT_EQ(processor(), before);
}

}  // namespace
}  // namespace cdprcal::lanes
