"""What the numbers of a movement show by themselves: jumps, wrapped angles, turned signs, stillness.

Each function takes tables (T, n) or columns (T,) that are finite, in the order of time, and knows no names.
"""
