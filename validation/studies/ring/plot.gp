# gnuplot -e "table='ring_force.csv'; plot_file='ring_force.svg'" plot.gp
set terminal svg size 640,440 font 'Helvetica,13' background rgb 'white'
set output plot_file
set datafile separator ','
set xlabel 'way of the tail [mm]'
set ylabel 'push on a quarter of the body [N]'
set grid
set key top right
plot for [n in '2 4 8'] table using (int($1) == int(n) ? $2 * 310 : 1/0):3 with linespoints pt 7 ps 0.4 title n.' cells'
